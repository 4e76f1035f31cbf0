// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/base/stage_times.h"
#include "waymark/map/messages.h"

namespace waymark {

/// What is known of a frame right after it was tracked. A copy keeps its features in memory.
struct TrackingResult : FrameStatus {
  FrameId frame;                         ///< Of this session, from 0 on.
  std::optional<Rigid3> world_from_rig;  ///< The pose, in metres (map units for mono).
  /// Covariance of the pose for perturbations exp(xi) * rig_from_world, xi = (rho, phi) in (m,
  /// rad).
  Matrix6d covariance = Matrix6d::Zero();
  bool is_keyframe = false;        ///< Whether it was sent to the map.
  bool is_relocalized = false;     ///< Whether the camera was found again after a loss.
  std::uint32_t num_features = 0;  ///< Of camera 0.
  StageTimes stages;               ///< What it took.

  FrameId frame_in_map;  ///< As keyframes of the map have it: goes on from those made before.
  std::shared_ptr<const Features> features;  ///< Null for a frame that could not be used.
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none; empty without a pose.
  /// Where the frame has a pose, by reference: it moves as the map is corrected, see
  /// Map::rig_from_world(). A keyframe refers to itself; it may not be in the newest map yet.
  RelativePose pose;
  std::vector<FilledPose> filled;  ///< Earlier frames that have a pose now.
};

}  // namespace waymark

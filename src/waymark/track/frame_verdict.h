// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/track/messages.h"

namespace waymark {

/// What is known of a frame once it was looked for in the map.
struct FrameVerdict : FrameStatus {
  std::optional<Rigid3> world_from_rig;  ///< The pose, in metres (map units for mono).
  /// Covariance of the pose for perturbations exp(xi) * rig_from_world, xi = (rho, phi) in (m,
  /// rad).
  Matrix6d covariance = Matrix6d::Zero();
};

/// More of the newest frame, for those who show it. Poses are by reference: they move as the map is
/// corrected, see Map::rig_from_world(); the reference may not be in the newest map yet.
struct FrameDetails {
  FrameId frame;  ///< As keyframes of the map have it: goes on from those of a map made before.
  std::shared_ptr<const Features> features;  ///< Null for a frame that could not be used.
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none; empty without a pose.
  RelativePose pose;                  ///< Where the frame has one; a keyframe refers to itself.
  std::vector<FilledPose> filled;     ///< Earlier frames that have a pose now.
};

}  // namespace waymark

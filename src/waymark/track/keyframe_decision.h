// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "waymark/track/frame_locator.h"
#include "waymark/track/settings.h"

namespace waymark {

/// What the decision to make a keyframe rests on.
struct KeyframeSituation {
  int num_reference = 0;       ///< Established landmarks that the reference keyframe sees.
  int num_shared = 0;          ///< Of these, the ones that the frame sees too.
  int num_near_untracked = 0;  ///< Features with a reliable range but no landmark.
  int num_near_tracked = 0;    ///< Features with a reliable range and a landmark.
  int frames_since_keyframe = 0;
  std::size_t num_pending = 0;      ///< Keyframes sent that the visible map does not contain yet.
  double median_parallax_px = 0.0;  ///< Of the landmarks, between reference keyframe and frame.
  bool has_range = false;           ///< Stereo or depth.
};

/// What a keyframe sees, and from where.
struct KeyframeView {
  std::vector<LandmarkId> landmarks;  ///< Of the primary camera; perhaps merged since.
  Eigen::Vector3d centre;             ///< In the world.
};

KeyframeView view_of(const Keyframe& keyframe);
/// Of a frame that becomes a keyframe.
KeyframeView view_of(const Features& features,
                     std::span<const LandmarkId> landmarks,
                     const Rigid3& rig_from_world);

/// What a frame says of itself beside a keyframe; num_pending and frames_since_keyframe are left to
/// the caller. submap_age: keyframes that the sub-map has had so far.
KeyframeSituation compare_with_reference(const Features& features,
                                         bool has_range,
                                         const LocatedFrame& located,
                                         const Map& map,
                                         const KeyframeView& reference,
                                         std::size_t submap_age,
                                         const KeyframeOptions& options = {});

/// Whether a frame should become a keyframe.
bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings);

}  // namespace waymark

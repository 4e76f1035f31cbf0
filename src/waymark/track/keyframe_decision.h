// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "waymark/track/settings.h"

namespace waymark {

/// What the decision to make a keyframe rests on.
struct KeyframeSituation {
  int num_inliers = 0;         ///< Landmarks the frame sees.
  int num_reference = 0;       ///< Well established landmarks its reference keyframe sees.
  int num_near_untracked = 0;  ///< Features with a reliable range but no landmark.
  int num_near_tracked = 0;    ///< Features with a reliable range and a landmark.
  int frames_since_keyframe = 0;
  std::size_t num_pending = 0;  ///< Keyframes sent that the visible map does not contain yet.
  double median_motion_px =
      0.0;                 ///< Of the landmarks, between reference and frame, rotation removed.
  bool has_range = false;  ///< Stereo or depth.
};

/// Whether a frame should become a keyframe.
bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings);

}  // namespace waymark

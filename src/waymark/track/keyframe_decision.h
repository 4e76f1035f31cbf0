// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

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

/// Whether a frame should become a keyframe.
bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings);

}  // namespace waymark

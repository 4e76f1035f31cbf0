// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

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

/// What a frame says of itself beside the keyframe that shares most landmarks with it; num_pending
/// and frames_since_keyframe are left to the caller. submap_age: keyframes that the sub-map has had
/// so far.
KeyframeSituation compare_with_reference(const Features& features,
                                         bool has_range,
                                         const LocatedFrame& located,
                                         const Map& map,
                                         KeyframeId reference,
                                         std::size_t submap_age,
                                         const KeyframeOptions& options = {});

/// Whether a frame should become a keyframe.
bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings);

}  // namespace waymark

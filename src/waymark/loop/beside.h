// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// How far a view may be from another to show the same.
struct ViewReach {
  double distance = 0.0;   ///< Between the rigs, in parts of the median depth of the scene.
  double angle_rad = 0.0;  ///< Of the rotation between them.
};

/// Keyframes of the same sub-map within reach in space of which the covisibility graph does not
/// know it: that are more than so many steps away there (see within_steps()). Nearest first.
std::vector<KeyframeId> strangers_beside(const Map& map,
                                         KeyframeId keyframe,
                                         int num_known_steps,
                                         const ViewReach& reach);

}  // namespace waymark

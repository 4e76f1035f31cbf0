// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/simulate/motion.h"

namespace waymark {

/// Keys of a Motion of duration_s that goes along the whole of another, in a time of its own. What
/// the other takes for it does not count.

/// As a car does: it moves where it looks, at a constant speed but for two stops, of a tenth of the
/// time each.
std::vector<MotionKey> drive_along(const Motion& way, double duration_s);

/// As a quadrotor does: ahead, rising and sinking by 0.15 m, and tilted so that it has no specific
/// force sideways or ahead (banked turns).
std::vector<MotionKey> fly_along(const Motion& way, double duration_s);

/// Standing at its start for rest_s, or half of the time where that is shorter, then going on.
std::vector<MotionKey> rest_before(const Motion& way, double rest_s, double duration_s);

}  // namespace waymark

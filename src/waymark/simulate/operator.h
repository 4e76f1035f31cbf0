// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/simulate/motion.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// Adds somebody who carries the camera on a short pole above the head, as 360 degree cameras are:
/// head, shoulders, an arm and what they wear fill the view downwards, to about 30 degrees from
/// straight down. The pole is fixed to the camera; the body faces where the camera does, stays
/// upright, and sways below it by a few degrees and centimetres, as somebody who walks. What is
/// below the floor does not show.
void add_operator(const Motion& motion, std::uint64_t seed, World& world);

}  // namespace waymark

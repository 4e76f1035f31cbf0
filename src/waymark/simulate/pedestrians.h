// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/simulate/motion.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// Adds people who cross the view of a camera at the height of eyes, `num_walkers` of them at any
/// time, 1.1 to 1.8 m ahead, and walk along with it meanwhile, as in a crowd. Clothes have
/// patterns, so that they have as many corners as what they hide.
void add_pedestrians(int num_walkers, const Motion& motion, std::uint64_t seed, World& world);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/simulate/motion.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// Adds `num_changes` things beside the way of a camera that do not stay as they are: by turns a
/// cupboard (in a street a lorry) that is gone in the second half of the motion, and a door that is
/// open then. Each changes when the camera has its back to it. They hide what is behind them and
/// have as many corners as that. Throws InputError where there is no room for so many.
void add_changes(int num_changes, const Motion& motion, std::uint64_t seed, World& world);

}  // namespace waymark

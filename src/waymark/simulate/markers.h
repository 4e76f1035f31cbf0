// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/marker/known_markers.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// Hangs markers 0, 1, ... (tag36h11) where a camera on its way sees them often: on walls and other
/// flat surfaces ahead of it, spread over the way. In a flat they are 20 cm wide, in larger worlds
/// larger. Gives their size and true poses in the world. The same arguments give the same result;
/// InputError where there is no room for so many.
KnownMarkers add_markers(int num_markers, const Motion& motion, std::uint64_t seed, World& world);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "waymark/map/map.h"
#include "waymark/mapping/associate.h"

namespace waymark {

/// Takes back loops of a sub-map that turned out to be false: without their edges, keyframes go to
/// where odometry and the other loops put them, and landmarks that this tears apart are split:
/// observations that do not see the landmark any more see one of their own, where they had it.
/// All keyframes must be noted, see note_odometry().
/// \param is_on  1 or 0 per loop edge of the map.
/// \param also   further loops that are believed, as Map::measured_loop_edges() would give them.
void undo_loops(Map& map,
                SubmapId submap,
                std::span<const std::uint8_t> is_on,
                std::span<const LoopEdge> also,
                DirtyLandmarks& dirty);

}  // namespace waymark

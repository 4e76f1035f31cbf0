// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/map/correction.h"
#include "waymark/map/map.h"

namespace waymark {

/// Notes in the map where the keyframes that are not noted yet lie to each other by what was seen
/// on the way: to be called before a loop or an adjustment moves them. Once a loop has been spread
/// over the map, what the map says of two keyframes agrees with it; this does not, so that it can
/// still contradict. What a map without such notes holds of loops is taken for what was seen on the
/// way. first: all before it are noted.
void note_odometry(Map& map, KeyframeId first = KeyframeId{0});

/// A loop edge as Map::measured_loop_edges() would give it.
LoopEdge as_measured(const Map& map, const LoopEdge& loop);

/// Which loops of a sub-map agree with each other and with the odometry, 1 or 0 per loop: see
/// reject_outlier_edges(). The loops that joined sub-maps, whose odometry nothing else ties, do.
/// All keyframes must be noted.
/// \param loops         as Map::measured_loop_edges() gives them; of other sub-maps: 1.
/// \param num_believed  the first so many were believed before.
std::vector<std::uint8_t> choose_loops(const Map& map,
                                       SubmapId submap,
                                       std::span<const LoopEdge> loops,
                                       std::size_t num_believed);

/// Where odometry and loops that agree put the keyframes of a sub-map, whatever the map says now.
/// The root stays.
MapCorrection place_by_odometry(const Map& map, SubmapId submap, std::span<const LoopEdge> loops);

}  // namespace waymark

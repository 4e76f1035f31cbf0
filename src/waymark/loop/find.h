// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/loop/options.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// Keyframes that share so many landmarks are linked in the covisibility graph (Mur-Artal et al.
/// 2015, III.D); fewer may have been seen again by chance.
inline constexpr std::uint32_t kMinSharedOfLinked = 15;

/// Whether the lengths around a keyframe are metres.
bool has_metric_submap(const Map& map, KeyframeId keyframe);

/// The keyframe and those so many steps away from it, by covisibility or up the spanning tree;
/// ascending.
std::vector<KeyframeId> within_steps(const Map& map, KeyframeId keyframe, int num_steps);

/// The keyframe and its strongest neighbours.
std::vector<KeyframeId> with_neighbours(const Map& map, KeyframeId keyframe, std::size_t max_count);

/// Keyframes of other places that look like the query, best first: none that the map links to it by
/// a few steps of covisibility, few of one place, and none that look less like it than the query's
/// own surroundings do by far. As many of the query's sub-map as of the others: places of its own
/// that only look alike do not take the places of those.
std::vector<KeyframeId> find_alike(const Map& map,
                                   const PlaceIndex& places,
                                   KeyframeId query,
                                   const CandidateOptions& options = {});

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/close.h"

#include <algorithm>
#include <vector>

#include "waymark/loop/find.h"
#include "waymark/loop/spatial_neighbours.h"
#include "waymark/map/align.h"
#include "waymark/mapping/fuse.h"

namespace waymark {
namespace {

/// Keyframes on either side in which landmarks are fused.
constexpr std::size_t kNumNeighbours = 10;

/// Moves the younger sub-map to the older, which it belongs to from then on.
void move_to_older(Map& map, PlaceIndex& places, const LoopCandidate& candidate) {
  const Keyframe& query = map.keyframes().at(candidate.query);
  const Keyframe& match = map.keyframes().at(candidate.match);
  const SubmapId of_query = query.submap;
  const SubmapId of_match = match.submap;
  const Sim3 query_from_world_of_match = candidate.query_from_match * Sim3(match.rig_from_world);
  const Sim3 of_query_from_of_match =
      Sim3(query.rig_from_world.inverse()) * query_from_world_of_match;
  if (of_match < of_query) {
    transform_submap(map, of_query, of_query_from_of_match.inverse());
    map.join_submaps(candidate.query, candidate.match);
    places.join(of_query, of_match);
  } else {
    transform_submap(map, of_match, of_query_from_of_match);
    map.join_submaps(candidate.match, candidate.query);
    places.join(of_match, of_query);
  }
}

/// Views further apart show too little of the same.
constexpr SpatialNeighbourOptions kOverlapping = {
    .num_known_steps = 1, .distance = 0.6, .angle_rad = 0.5};
constexpr std::size_t kMaxSources = 6;

void fuse_both_sides(Map& map,
                     const LoopCandidate& candidate,
                     ProjectionMatcher& matcher,
                     DirtyLandmarks& dirty) {
  const auto of_query = with_neighbours(map, candidate.query, kNumNeighbours);
  const auto of_match = with_neighbours(map, candidate.match, kNumNeighbours);
  for (const LoopCandidate::Pair& pair : candidate.pairs) {
    const LandmarkId seen_by_query = map.resolve(pair.of_query);
    const LandmarkId seen_by_match = map.resolve(pair.of_match);
    if (seen_by_query.is_valid() && seen_by_match.is_valid() && seen_by_query != seen_by_match) {
      merge(map, seen_by_query, seen_by_match, dirty);
    }
  }
  for (KeyframeId id : of_query) fuse_into(map, of_match, id, matcher, dirty);
  for (KeyframeId id : of_match) fuse_into(map, of_query, id, matcher, dirty);
}

}  // namespace

void close_loop(Map& map,
                const LoopCandidate& candidate,
                const MapCorrection& correction,
                ProjectionMatcher& matcher,
                DirtyLandmarks& dirty) {
  map.add_loop_edge(as_loop(candidate));
  apply_correction(map, correction);
  fuse_both_sides(map, candidate, matcher, dirty);
}

void join_submaps(Map& map,
                  PlaceIndex& places,
                  const LoopCandidate& candidate,
                  ProjectionMatcher& matcher,
                  DirtyLandmarks& dirty) {
  map.add_loop_edge(as_loop(candidate));
  move_to_older(map, places, candidate);
  fuse_both_sides(map, candidate, matcher, dirty);
}

void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty) {
  const KeyframePositions positions(map);
  const std::uint32_t end = map.keyframes().end_id().value;
  for (KeyframeId id{0}; id.value < end; ++id.value) {
    if (!map.keyframes().contains(id)) continue;
    std::vector<KeyframeId> sources = positions.find_spatial_neighbours(map, id, kOverlapping);
    if (sources.size() > kMaxSources) sources.resize(kMaxSources);
    if (!sources.empty()) fuse_into(map, sources, id, matcher, dirty);
  }
}

}  // namespace waymark

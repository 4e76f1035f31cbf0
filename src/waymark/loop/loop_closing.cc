// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_closing.h"

#include "waymark/base/check.h"
#include "waymark/loop/spread_drift.h"
#include "waymark/map/align.h"
#include "waymark/map/correction.h"
#include "waymark/mapping/fuse.h"

namespace waymark {
namespace {

/// Keyframes on either side in which landmarks are fused.
constexpr std::size_t kNumNeighbours = 10;

LoopEdge edge_of(const Revisit& revisit) {
  return {revisit.match, revisit.query, revisit.query_from_match};
}

std::vector<KeyframeId> with_neighbours(const Map& map, KeyframeId id) {
  std::vector<KeyframeId> ids = strongest_neighbours(map, id, kNumNeighbours);
  ids.insert(ids.begin(), id);
  return ids;
}

/// Both sides of a revisit, as they were before they were fused.
struct Sides {
  std::vector<KeyframeId> of_query;
  std::vector<KeyframeId> of_match;
};

void fuse_sides(Map& map,
                const Revisit& revisit,
                const Sides& sides,
                ProjectionMatcher& matcher,
                DirtyLandmarks& dirty) {
  for (const Revisit::Pair& pair : revisit.pairs) {
    const LandmarkId of_query = map.resolve(pair.of_query);
    const LandmarkId of_match = map.resolve(pair.of_match);
    if (of_query.is_valid() && of_match.is_valid() && of_query != of_match) {
      merge(map, of_query, of_match, dirty);
    }
  }
  for (KeyframeId id : sides.of_query) fuse_into(map, sides.of_match, id, matcher, dirty);
  for (KeyframeId id : sides.of_match) fuse_into(map, sides.of_query, id, matcher, dirty);
}

}  // namespace

void close_loop(Map& map,
                const Revisit& revisit,
                ProjectionMatcher& matcher,
                DirtyLandmarks& dirty) {
  const Sides sides{with_neighbours(map, revisit.query), with_neighbours(map, revisit.match)};
  const MapCorrection correction = spread_drift(map, edge_of(revisit));
  map.add_loop_edge(edge_of(revisit));
  apply_correction(map, correction);
  fuse_sides(map, revisit, sides, matcher, dirty);
}

void join_submaps(Map& map,
                  PlaceIndex& places,
                  const Revisit& revisit,
                  ProjectionMatcher& matcher,
                  DirtyLandmarks& dirty) {
  const Sides sides{with_neighbours(map, revisit.query), with_neighbours(map, revisit.match)};
  const Keyframe& query = map.keyframes().at(revisit.query);
  const Keyframe& match = map.keyframes().at(revisit.match);
  const SubmapId of_query = query.submap;
  const SubmapId of_match = match.submap;
  WAYMARK_CHECK(of_query != of_match);
  const Sim3 query_from_world_of_match = revisit.query_from_match * Sim3(match.rig_from_world);
  const Sim3 of_query_from_of_match =
      Sim3(query.rig_from_world.inverse()) * query_from_world_of_match;
  const bool moves_query = of_match < of_query;
  const SubmapId younger = moves_query ? of_query : of_match;
  const SubmapId older = moves_query ? of_match : of_query;
  map.add_loop_edge(edge_of(revisit));
  transform_submap(
      map, younger, moves_query ? of_query_from_of_match.inverse() : of_query_from_of_match);
  map.join_submaps(moves_query ? revisit.query : revisit.match,
                   moves_query ? revisit.match : revisit.query);
  places.join(younger, older);
  fuse_sides(map, revisit, sides, matcher, dirty);
}

bool close_revisit(Map& map,
                   PlaceIndex& places,
                   const Revisit& revisit,
                   ProjectionMatcher& matcher,
                   DirtyLandmarks& dirty) {
  const auto& keyframes = map.keyframes();
  const bool is_join = keyframes.at(revisit.query).submap != keyframes.at(revisit.match).submap;
  if (is_join) {
    join_submaps(map, places, revisit, matcher, dirty);
  } else {
    close_loop(map, revisit, matcher, dirty);
  }
  return is_join;
}

}  // namespace waymark

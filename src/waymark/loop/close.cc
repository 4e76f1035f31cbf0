// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/close.h"

#include <algorithm>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/loop/beside.h"
#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"
#include "waymark/map/align.h"
#include "waymark/mapping/fuse.h"
#include "waymark/optimize/pose_graph.h"

namespace waymark {
namespace {

/// Keyframes on either side in which landmarks are fused.
constexpr std::size_t kNumNeighbours = 10;
/// Keyframes that share so many landmarks have an edge of the pose graph (Mur-Artal et al. 2015,
/// III.D).
constexpr std::uint32_t kMinShared = 100;
/// Standard deviations of what the map says of two keyframes that are linked; that of the
/// translation is in parts of the depth of what is seen.
constexpr double kSigmaTranslation = 0.005;
constexpr double kSigmaRotationRad = 0.002;
constexpr double kSigmaLogScale = 0.005;
/// Those of a loop in parts of these. Many links run side by side between places of the map and
/// share their errors, so that together they would seem surer of the way than they are.
constexpr double kLoopSigmas = 0.1;

/// The pose graph of a sub-map. Its nodes are rigs, with the world in units of now.
class SubmapGraph {
 public:
  SubmapGraph(const Map& map, SubmapId submap) : map_(map) {
    const Submap& row = map.submaps()[submap.value];
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (keyframe.submap != submap) return;
      ids_.push_back(id);
      graph_.node_from_world.push_back(Sim3(keyframe.rig_from_world));
      graph_.is_fixed.push_back(id == row.root);
    });
    graph_.is_scale_free = !row.is_metric;
    for (KeyframeId id : ids_) add_edges_of_map(id);
  }

  void add_loop(const LoopEdge& loop, bool is_robust) {
    if (!contains(loop.from) || !contains(loop.to)) return;
    PoseGraphEdge edge = make_edge(loop.from, loop.to, kLoopSigmas);
    edge.to_from_from = loop.to_from_from;
    edge.is_robust = is_robust;
    graph_.edges.push_back(edge);
  }

  MapCorrection solve() {
    optimize_pose_graph(graph_, {});
    MapCorrection correction;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      const Sim3& node = graph_.node_from_world[i];
      // A node keeps its lengths, of which one is now 1 / scale of the world's.
      correction.keyframes.push_back(
          {ids_[i], {node.rotation, node.translation / node.scale}, 1.0 / node.scale});
    }
    return correction;
  }

 private:
  bool contains(KeyframeId id) const { return std::binary_search(ids_.begin(), ids_.end(), id); }

  std::uint32_t index_of(KeyframeId id) const {
    WAYMARK_CHECK(contains(id));
    const auto at = std::lower_bound(ids_.begin(), ids_.end(), id);
    return static_cast<std::uint32_t>(at - ids_.begin());
  }

  PoseGraphEdge make_edge(KeyframeId from, KeyframeId to, double sigmas) const {
    PoseGraphEdge edge;
    edge.from = index_of(from);
    edge.to = index_of(to);
    edge.sigma_translation = sigmas * kSigmaTranslation * depth_of(to);
    edge.sigma_rotation_rad = sigmas * kSigmaRotationRad;
    edge.sigma_log_scale = sigmas * kSigmaLogScale;
    return edge;
  }

  /// A keyframe that sees nothing is as well placed as one that sees things nearby.
  double depth_of(KeyframeId id) const {
    const double depth = median_depth(map_, id);
    return depth > 0.0 ? depth : 1.0;
  }

  /// Every pair once: where both a child and strong covisibility link two, the child does.
  void add_edges_of_map(KeyframeId id) {
    const KeyframeId parent = map_.keyframes().at(id).parent;
    if (parent.is_valid()) add_as_mapped(parent, id);
    for (const CovisibilityEdge& edge : map_.covisible(id)) {
      if (edge.keyframe < id && edge.keyframe != parent && edge.num_shared >= kMinShared &&
          map_.keyframes().at(edge.keyframe).parent != id) {
        add_as_mapped(edge.keyframe, id);
      }
    }
  }

  void add_as_mapped(KeyframeId from, KeyframeId to) {
    PoseGraphEdge edge = make_edge(from, to, 1.0);
    edge.to_from_from =
        graph_.node_from_world[edge.to] * graph_.node_from_world[edge.from].inverse();
    graph_.edges.push_back(edge);
  }

  const Map& map_;
  std::vector<KeyframeId> ids_;  // Ascending, one per node.
  PoseGraph graph_;
};

/// Moves the younger sub-map to the older, which it belongs to from then on.
void join_submaps(Map& map, PlaceIndex& places, const Revisit& revisit) {
  const Keyframe& query = map.keyframes().at(revisit.query);
  const Keyframe& match = map.keyframes().at(revisit.match);
  const SubmapId of_query = query.submap;
  const SubmapId of_match = match.submap;
  const Sim3 query_from_world_of_match = revisit.query_from_match * Sim3(match.rig_from_world);
  const Sim3 of_query_from_of_match =
      Sim3(query.rig_from_world.inverse()) * query_from_world_of_match;
  if (of_match < of_query) {
    transform_submap(map, of_query, of_query_from_of_match.inverse());
    map.join_submaps(revisit.query, revisit.match);
    places.join(of_query, of_match);
  } else {
    transform_submap(map, of_match, of_query_from_of_match);
    map.join_submaps(revisit.match, revisit.query);
    places.join(of_match, of_query);
  }
}

/// Views further apart show too little of the same.
constexpr BesideOptions kOverlapping = {.num_known_steps = 1, .distance = 0.6, .angle_rad = 0.5};
constexpr std::size_t kMaxSources = 6;

}  // namespace

MapCorrection spread_drift(const Map& map, const LoopEdge& loop) {
  SubmapGraph graph(map, map.keyframes().at(loop.to).submap);
  for (const LoopEdge& old : map.loop_edges()) graph.add_loop(old, true);
  // The drift may be many standard deviations: a robust edge would not close it.
  graph.add_loop(loop, false);
  return graph.solve();
}

bool close_revisit(Map& map,
                   PlaceIndex& places,
                   const Revisit& revisit,
                   ProjectionMatcher& matcher,
                   DirtyLandmarks& dirty) {
  const auto& keyframes = map.keyframes();
  const bool is_join = keyframes.at(revisit.query).submap != keyframes.at(revisit.match).submap;
  const LoopEdge edge{revisit.match, revisit.query, revisit.query_from_match};
  const auto of_query = with_neighbours(map, revisit.query, kNumNeighbours);
  const auto of_match = with_neighbours(map, revisit.match, kNumNeighbours);
  if (is_join) {
    map.add_loop_edge(edge);
    join_submaps(map, places, revisit);
  } else {
    const MapCorrection correction = spread_drift(map, edge);
    map.add_loop_edge(edge);
    apply_correction(map, correction);
  }
  for (const Revisit::Pair& pair : revisit.pairs) {
    const LandmarkId seen_by_query = map.resolve(pair.of_query);
    const LandmarkId seen_by_match = map.resolve(pair.of_match);
    if (seen_by_query.is_valid() && seen_by_match.is_valid() && seen_by_query != seen_by_match) {
      merge(map, seen_by_query, seen_by_match, dirty);
    }
  }
  for (KeyframeId id : of_query) fuse_into(map, of_match, id, matcher, dirty);
  for (KeyframeId id : of_match) fuse_into(map, of_query, id, matcher, dirty);
  return is_join;
}

void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty) {
  const KeyframePositions positions(map);
  const std::uint32_t end = map.keyframes().end_id().value;
  for (KeyframeId id{0}; id.value < end; ++id.value) {
    if (!map.keyframes().contains(id)) continue;
    std::vector<KeyframeId> sources = positions.find_beside(map, id, kOverlapping);
    if (sources.size() > kMaxSources) sources.resize(kMaxSources);
    if (!sources.empty()) fuse_into(map, sources, id, matcher, dirty);
  }
}

}  // namespace waymark

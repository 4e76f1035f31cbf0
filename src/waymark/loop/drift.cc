// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/drift.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/loop/find.h"

namespace waymark {
namespace {

/// Drift that is possible, in parts of the way and, even where the camera only turned, of the
/// distance of what is seen. True loops of hand-held and driven sequences had at most 0.002 of the
/// way beyond what drift of direction and scale explain, rooms that are alike 0.05 and more.
constexpr double kMaxDriftOfWay = 0.025;
constexpr double kMaxDriftOfDepth = 0.1;
constexpr double kMaxAngleRad = 0.05;
constexpr double kMaxAnglePerStepRad = 0.01;
constexpr double kMaxAngleAtAllRad = 0.5;
constexpr double kMaxLogScale = 0.1;
constexpr double kMaxLogScalePerStep = 0.03;
constexpr double kMaxLogScaleAtAll = 0.7;
/// For what rounding does to the length of a way that is just long enough.
constexpr double kMargin = 1e-9;

struct Arrival {
  double length;
  int num_steps;
  KeyframeId keyframe;
  friend auto operator<=>(const Arrival&, const Arrival&) = default;
};

/// Among what shares a landmark with a keyframe, as children commonly do.
template <class Visit>
void visit_seen_children(const Map& map, KeyframeId id, const Visit& visit) {
  for (const CovisibilityEdge& edge : map.covisible(id)) {
    if (map.keyframes().at(edge.keyframe).parent == id) visit(edge.keyframe);
  }
}

/// Children in the spanning tree per keyframe, by value of the id.
std::vector<std::vector<KeyframeId>> list_children(const Map& map) {
  std::vector<std::vector<KeyframeId>> children(map.keyframes().end_id().value);
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.parent.is_valid()) children[keyframe.parent.value].push_back(id);
  });
  return children;
}

/// Dijkstra's search. visit_children(id, visit): of the spanning tree.
template <class VisitChildren>
std::optional<GraphWay> search_way(const Map& map,
                                   KeyframeId from,
                                   KeyframeId to,
                                   double enough,
                                   const VisitChildren& visit_children) {
  std::vector<double> lengths(map.keyframes().end_id().value,
                              std::numeric_limits<double>::infinity());
  std::priority_queue<Arrival, std::vector<Arrival>, std::greater<>> queue;
  const auto arrive = [&](KeyframeId id, double length, int num_steps) {
    if (!(length < lengths[id.value])) return;
    lengths[id.value] = length;
    queue.push({length, num_steps, id});
  };
  arrive(from, 0.0, 0);
  while (!queue.empty()) {
    const Arrival here = queue.top();
    queue.pop();
    if (here.keyframe == to || here.length >= enough) return GraphWay{here.length, here.num_steps};
    if (here.length > lengths[here.keyframe.value]) continue;
    const Keyframe& keyframe = map.keyframes().at(here.keyframe);
    const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
    const auto go = [&](KeyframeId next) {
      const Rigid3& next_from_world = map.keyframes().at(next).rig_from_world;
      const double step = (next_from_world.origin_in_source() - centre).norm();
      arrive(next, here.length + step, here.num_steps + 1);
    };
    if (keyframe.parent.is_valid()) go(keyframe.parent);
    visit_children(here.keyframe, go);
    for (const CovisibilityEdge& edge : map.covisible(here.keyframe)) {
      if (edge.num_shared >= kMinSharedOfLinked) go(edge.keyframe);
    }
  }
  return std::nullopt;
}

}  // namespace

double median_depth(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes().at(id);
  std::vector<double> distances;
  for (LandmarkId landmark : keyframe.landmarks) {
    if (!landmark.is_valid()) continue;
    distances.push_back(
        (keyframe.rig_from_world * map.landmarks().at(landmark).position_in_world).norm());
  }
  return distances.empty() ? 0.0 : median(distances);
}

std::optional<GraphWay> shortest_way(const Map& map,
                                     KeyframeId from,
                                     KeyframeId to,
                                     double enough) {
  if (map.keyframes().at(from).submap != map.keyframes().at(to).submap) return std::nullopt;
  const auto seen_children = [&](KeyframeId id, const auto& visit) {
    visit_seen_children(map, id, visit);
  };
  if (const auto way = search_way(map, from, to, enough, seen_children)) return way;
  const auto children = list_children(map);
  const auto all_children = [&](KeyframeId id, const auto& visit) {
    for (const KeyframeId child : children[id.value]) visit(child);
  };
  return search_way(map, from, to, enough, all_children);
}

ImpliedDrift implied_drift(const Map& map, const Revisit& revisit) {
  const Rigid3& query_from_world = map.keyframes().at(revisit.query).rig_from_world;
  const Rigid3& match_from_world = map.keyframes().at(revisit.match).rig_from_world;
  const Sim3 mapped(query_from_world * match_from_world.inverse());
  const Sim3 drift = mapped * revisit.query_from_match.inverse();
  return {drift.inverse().translation.norm(),
          Eigen::AngleAxisd(drift.rotation).angle(),
          std::log(drift.scale)};
}

bool is_plausible_loop(const Map& map, const Revisit& revisit, double part) {
  const ImpliedDrift drift = implied_drift(map, revisit);
  const double log_scale = std::abs(drift.log_scale);
  // What turned or grew by so much at the end did by half of that on average.
  const double per_length = kMaxDriftOfWay + 0.5 * (drift.angle_rad + log_scale);
  const double for_depth = kMaxDriftOfDepth * median_depth(map, revisit.match);
  // Where few steps are enough for the angle and the scale, only the length of the way is asked
  // for.
  const bool is_any_way_enough =
      drift.angle_rad <= part * kMaxAngleRad && log_scale <= part * kMaxLogScale;
  const double enough = is_any_way_enough
                            ? (1.0 + kMargin) * (drift.distance / part - for_depth) / per_length
                            : std::numeric_limits<double>::infinity();
  const std::optional<GraphWay> way = shortest_way(map, revisit.query, revisit.match, enough);
  if (!way) return false;
  const double max_distance = per_length * way->length + for_depth;
  const double max_angle =
      std::min(kMaxAngleRad + kMaxAnglePerStepRad * way->num_steps, kMaxAngleAtAllRad);
  const double max_log_scale =
      std::min(kMaxLogScale + kMaxLogScalePerStep * way->num_steps, kMaxLogScaleAtAll);
  return drift.distance <= part * max_distance && drift.angle_rad <= part * max_angle &&
         log_scale <= part * max_log_scale;
}

}  // namespace waymark

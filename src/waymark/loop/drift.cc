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
constexpr double kMaxSteps = 1e8;  // No map has as many.
/// For what rounding does to a way that is just long enough.
constexpr double kMargin = 1e-9;

/// How far an angle or the logarithm of the scale may be off after some steps. Errors of odometry
/// go one way for a while, where they add up; from one such stretch to the next they are a random
/// walk, so that they grow with the root.
struct Growth {
  double at_once;
  double per_step;
  double num_straight;  ///< Steps for which errors go one way.

  double after(int num_steps) const {
    const double steps = num_steps;
    return at_once + per_step * (steps <= num_straight ? steps : std::sqrt(num_straight * steps));
  }

  /// So many steps are enough for a value, or hardly more.
  int enough_for(double value) const {
    const double straight = (value - at_once) / per_step;
    const double steps = straight <= num_straight ? straight : straight * straight / num_straight;
    return static_cast<int>(std::ceil(std::clamp(steps, 0.0, kMaxSteps) * (1.0 + kMargin)));
  }
};
constexpr Growth kMaxAngleRad{0.05, 0.01, 45.0};
constexpr Growth kMaxLogScale{0.1, 0.03, 20.0};

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

/// Dijkstra's search.
class WaySearch {
 public:
  WaySearch(const Map& map, KeyframeId to, const std::optional<GraphWay>& enough)
      : map_(map), to_(to), enough_(enough), reached_(map.keyframes().end_id().value, kUnreached) {}

  /// visit_children(id, visit): of the spanning tree.
  template <class VisitChildren>
  std::optional<GraphWay> search(KeyframeId from, const VisitChildren& visit_children) {
    arrive({0.0, 0, from});
    while (!queue_.empty()) {
      const Arrival here = queue_.top();
      queue_.pop();
      const GraphWay& way = reached_[here.keyframe.value];
      if (here.keyframe == to_) return way;
      if (here.length > way.length) continue;
      // The way leads through one of those that are reached and not left yet.
      if (enough_ && num_short_ == 0) return enough_;
      num_short_ -= is_short(way);
      go_on_from(here, visit_children);
    }
    return std::nullopt;
  }

 private:
  static constexpr GraphWay kUnreached{std::numeric_limits<double>::infinity(), 0};

  bool is_short(const GraphWay& way) const {
    return enough_ && (way.length < enough_->length || way.num_steps < enough_->num_steps);
  }

  void arrive(const Arrival& there) {
    GraphWay& way = reached_[there.keyframe.value];
    if (!(there.length < way.length)) return;
    if (std::isfinite(way.length)) num_short_ -= is_short(way);
    way = {there.length, there.num_steps};
    num_short_ += is_short(way);
    queue_.push(there);
  }

  template <class VisitChildren>
  void go_on_from(const Arrival& here, const VisitChildren& visit_children) {
    const Keyframe& keyframe = map_.keyframes().at(here.keyframe);
    const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
    const auto go = [&](KeyframeId next) {
      const Rigid3& next_from_world = map_.keyframes().at(next).rig_from_world;
      const double step = (next_from_world.origin_in_source() - centre).norm();
      arrive({here.length + step, here.num_steps + 1, next});
    };
    if (keyframe.parent.is_valid()) go(keyframe.parent);
    visit_children(here.keyframe, go);
    for (const CovisibilityEdge& edge : map_.covisible(here.keyframe)) {
      if (edge.num_shared >= kMinSharedOfLinked) go(edge.keyframe);
    }
  }

  const Map& map_;
  const KeyframeId to_;
  const std::optional<GraphWay>& enough_;
  std::vector<GraphWay> reached_;  // The ways to keyframes by value of the id.
  std::priority_queue<Arrival, std::vector<Arrival>, std::greater<>> queue_;
  std::size_t num_short_ = 0;  // In the queue, without what a shorter way has replaced: not enough.
};

}  // namespace

double median_depth(const Map& map, KeyframeId id, std::size_t num_landmarks) {
  const Keyframe& keyframe = map.keyframes().at(id);
  const auto num_seen = std::ranges::count_if(keyframe.landmarks, &LandmarkId::is_valid);
  const std::size_t stride = static_cast<std::size_t>(num_seen) / num_landmarks + 1;
  std::vector<double> distances;
  std::size_t number = 0;
  for (const LandmarkId landmark : keyframe.landmarks) {
    if (!landmark.is_valid() || number++ % stride != 0) continue;
    distances.push_back(
        (keyframe.rig_from_world * map.landmarks().at(landmark).position_in_world).norm());
  }
  return distances.empty() ? 0.0 : median(distances);
}

std::optional<GraphWay> shortest_way(const Map& map,
                                     KeyframeId from,
                                     KeyframeId to,
                                     const std::optional<GraphWay>& enough) {
  if (map.keyframes().at(from).submap != map.keyframes().at(to).submap) return std::nullopt;
  const auto seen_children = [&](KeyframeId id, const auto& visit) {
    visit_seen_children(map, id, visit);
  };
  if (const auto way = WaySearch(map, to, enough).search(from, seen_children)) return way;
  const auto children = list_children(map);
  const auto all_children = [&](KeyframeId id, const auto& visit) {
    for (const KeyframeId child : children[id.value]) visit(child);
  };
  return WaySearch(map, to, enough).search(from, all_children);
}

ImpliedDrift implied_drift(const Map& map, const LoopCandidate& candidate) {
  const Rigid3& query_from_world = map.keyframes().at(candidate.query).rig_from_world;
  const Rigid3& match_from_world = map.keyframes().at(candidate.match).rig_from_world;
  const Sim3 mapped(query_from_world * match_from_world.inverse());
  const Sim3 drift = mapped * candidate.query_from_match.inverse();
  return {drift.inverse().translation.norm(),
          Eigen::AngleAxisd(drift.rotation).angle(),
          std::log(drift.scale)};
}

bool is_plausible_loop(const Map& map, const LoopCandidate& candidate, double part) {
  const ImpliedDrift drift = implied_drift(map, candidate);
  const double log_scale = std::abs(drift.log_scale);
  // What turned or grew by so much at the end did by half of that on average.
  const double per_length = kMaxDriftOfWay + 0.5 * (drift.angle_rad + log_scale);
  const double for_depth = kMaxDriftOfDepth * median_depth(map, candidate.match);
  const double enough_length = (drift.distance / part - for_depth) / per_length;
  const GraphWay enough{(1.0 + kMargin) * std::max(enough_length, 0.0),
                        std::max(kMaxAngleRad.enough_for(drift.angle_rad / part),
                                 kMaxLogScale.enough_for(log_scale / part))};
  const std::optional<GraphWay> way = shortest_way(map, candidate.query, candidate.match, enough);
  if (!way) return false;
  return drift.distance <= part * (per_length * way->length + for_depth) &&
         drift.angle_rad <= part * kMaxAngleRad.after(way->num_steps) &&
         log_scale <= part * kMaxLogScale.after(way->num_steps);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_pose_graph.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "waymark/loop/drift.h"
#include "waymark/optimize/pose_graph.h"

namespace waymark {
namespace {

/// Keyframes that share so many landmarks have an edge of the pose graph (Mur-Artal et al. 2015,
/// III.D).
constexpr std::uint32_t kMinShared = 100;
/// Standard deviations of what the map says of two keyframes that are linked; that of the
/// translation is in parts of the depth of what is seen.
constexpr double kSigmaTranslation = 0.005;
constexpr double kSigmaRotationRad = 0.002;
constexpr double kSigmaLogScale = 0.005;
/// Those of the new loop in parts of these. Many links run side by side between places of the map
/// and share their errors, so that together they would seem surer of the way than they are. An old
/// loop is a link as any other: the map agrees with it, and what has been adjusted since knows
/// better than what was measured then.
constexpr double kLoopSigmas = 0.1;

/// Keyframes that may move at first, and how many times as many next. All of a map of fewer may.
constexpr std::size_t kFirstPart = 100;
constexpr std::size_t kGrowth = 4;
/// Residual of an edge at the rim, in standard deviations, that is left.
constexpr double kMaxStrain = 0.3;
/// Landmarks that tell how far away things are, on which the weights of edges rest.
constexpr std::size_t kNumForDepth = 32;
/// What is left to gain, as a share of the cost, when the graph is as good as solved: a thousandth
/// of a standard deviation.
constexpr double kNegligibleShare = 1e-6;

/// The essential graph of a map, one keyframe's links at a time.
class EssentialGraph {
 public:
  explicit EssentialGraph(const Map& map)
      : map_(map),
        first_child_(map.keyframes().end_id().value),
        next_sibling_(first_child_.size()) {
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (!keyframe.parent.is_valid()) return;
      next_sibling_[id.value] = std::exchange(first_child_[keyframe.parent.value], id);
    });
    for (const LoopEdge& loop : map.measured_loop_edges()) {
      other_ends_.push_back({loop.from, loop.to});
      other_ends_.push_back({loop.to, loop.from});
    }
    std::sort(other_ends_.begin(), other_ends_.end());
  }

  /// Calls visit(other) for what the spanning tree or strong covisibility links to a keyframe, of
  /// each pair from the younger one or from the child: every pair once.
  template <class Visit>
  void visit_older(KeyframeId id, const Visit& visit) const {
    const KeyframeId parent = map_.keyframes().at(id).parent;
    if (parent.is_valid()) visit(parent);
    for (const CovisibilityEdge& edge : map_.covisible(id)) {
      if (edge.keyframe < id && edge.keyframe != parent && edge.num_shared >= kMinShared &&
          map_.keyframes().at(edge.keyframe).parent != id) {
        visit(edge.keyframe);
      }
    }
  }

  /// Calls visit(other) for everything that is linked to a keyframe, some of it twice.
  template <class Visit>
  void visit_all(KeyframeId id, const Visit& visit) const {
    const KeyframeId parent = map_.keyframes().at(id).parent;
    if (parent.is_valid()) visit(parent);
    for (const CovisibilityEdge& edge : map_.covisible(id)) {
      if (edge.num_shared >= kMinShared) visit(edge.keyframe);
    }
    for (KeyframeId child = first_child_[id.value]; child.is_valid();
         child = next_sibling_[child.value]) {
      visit(child);
    }
    auto end =
        std::lower_bound(other_ends_.begin(), other_ends_.end(), std::pair(id, KeyframeId{0}));
    for (; end != other_ends_.end() && end->first == id; ++end) visit(end->second);
  }

 private:
  const Map& map_;
  std::vector<KeyframeId> first_child_;   // In the spanning tree, by value of the id.
  std::vector<KeyframeId> next_sibling_;  // The same.
  std::vector<std::pair<KeyframeId, KeyframeId>> other_ends_;  // Of loops, both ways; ascending.
};

/// What lies around the ends of a loop: keyframes that move, ring by ring, and the rim that holds
/// them.
class Surroundings {
 public:
  Surroundings(const EssentialGraph& graph, const Map& map, const LoopEdge& loop)
      : graph_(graph), place_(map.keyframes().end_id().value, kOutside) {
    for (const KeyframeId id : {loop.from, loop.to}) reach(id);
  }

  /// Until so many may move.
  void grow(std::size_t size) {
    while (!rim_.empty() && inner_.size() < size) {
      for (const KeyframeId id : std::exchange(rim_, {})) {
        place_[id.value] = kInside;
        inner_.push_back(id);
        graph_.visit_all(id, [&](KeyframeId other) { reach(other); });
      }
    }
  }

  const std::vector<KeyframeId>& inner() const { return inner_; }
  const std::vector<KeyframeId>& rim() const { return rim_; }
  bool is_rim(KeyframeId id) const { return place_[id.value] == kRim; }
  bool contains(KeyframeId id) const { return place_[id.value] != kOutside; }

 private:
  enum Place : std::uint8_t { kOutside, kRim, kInside };

  void reach(KeyframeId id) {
    if (place_[id.value] != kOutside) return;
    place_[id.value] = kRim;
    rim_.push_back(id);
  }

  const EssentialGraph& graph_;
  std::vector<Place> place_;  // By value of the id.
  std::vector<KeyframeId> inner_;
  std::vector<KeyframeId> rim_;
};

/// The pose graph of a part of a sub-map. Its nodes are rigs, with the world in units of now.
class PartGraph {
 public:
  PartGraph(const Map& map, const EssentialGraph& links, const Surroundings& part)
      : part_(part), ids_(part.inner()) {
    ids_.insert(ids_.end(), part.rim().begin(), part.rim().end());
    std::sort(ids_.begin(), ids_.end());
    const Submap& row = map.submaps()[map.keyframes().at(ids_.front()).submap.value];
    for (const KeyframeId id : ids_) {
      graph_.node_from_world.push_back(Sim3(map.keyframes().at(id).rig_from_world));
      graph_.is_fixed.push_back(id == row.root || part.is_rim(id));
      const double depth = median_depth(map, id, kNumForDepth);
      // A keyframe that sees nothing is as well placed as one that sees things nearby.
      depths_.push_back(depth > 0.0 ? depth : 1.0);
    }
    graph_.is_scale_free = !row.is_metric;
    for (const KeyframeId id : ids_) {
      links.visit_older(id, [&](KeyframeId older) { add_as_mapped(older, id); });
    }
    for (const LoopEdge& old : map.measured_loop_edges()) add_as_mapped(old.from, old.to);
  }

  /// Closes a loop; returns by how much it contradicts the rest.
  double close(const LoopEdge& loop) {
    PoseGraphEdge edge = make_edge(loop.from, loop.to, kLoopSigmas);
    edge.to_from_from = loop.to_from_from;
    graph_.edges.push_back(edge);
    return 2.0 * optimize_pose_graph(graph_, {.negligible_share = kNegligibleShare}).final_cost;
  }

  /// The longest residual at the rim, in standard deviations.
  double strain_at_rim() const {
    double strain = 0.0;
    for (const PoseGraphEdge& edge : graph_.edges) {
      if (part_.is_rim(ids_[edge.from]) || part_.is_rim(ids_[edge.to])) {
        strain = std::max(strain, residual_of_edge(edge).norm());
      }
    }
    return strain;
  }

  MapCorrection correction() const {
    MapCorrection correction;
    correction.is_of_part = !part_.rim().empty();
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (part_.is_rim(ids_[i])) continue;
      const Sim3& node = graph_.node_from_world[i];
      // A node keeps its lengths, of which one is now 1 / scale of the world's.
      correction.keyframes.push_back(
          {ids_[i], {node.rotation, node.translation / node.scale}, 1.0 / node.scale});
    }
    return correction;
  }

 private:
  std::uint32_t index_of(KeyframeId id) const {
    const auto at = std::lower_bound(ids_.begin(), ids_.end(), id);
    return static_cast<std::uint32_t>(at - ids_.begin());
  }

  /// Whether an edge says anything of what may move.
  bool is_of_part(KeyframeId a, KeyframeId b) const {
    return part_.contains(a) && part_.contains(b) && !(part_.is_rim(a) && part_.is_rim(b));
  }

  PoseGraphEdge make_edge(KeyframeId from, KeyframeId to, double sigmas) const {
    PoseGraphEdge edge;
    edge.from = index_of(from);
    edge.to = index_of(to);
    edge.sigma_translation = sigmas * kSigmaTranslation * depths_[edge.to];
    edge.sigma_rotation_rad = sigmas * kSigmaRotationRad;
    edge.sigma_log_scale = sigmas * kSigmaLogScale;
    return edge;
  }

  void add_as_mapped(KeyframeId from, KeyframeId to) {
    if (!is_of_part(from, to)) return;
    PoseGraphEdge edge = make_edge(from, to, 1.0);
    edge.to_from_from =
        graph_.node_from_world[edge.to] * graph_.node_from_world[edge.from].inverse();
    graph_.edges.push_back(edge);
  }

  Vector7d residual_of_edge(const PoseGraphEdge& edge) const {
    return pose_graph_residual(
               edge, graph_.node_from_world[edge.from], graph_.node_from_world[edge.to])
        .value;
  }

  const Surroundings& part_;
  std::vector<KeyframeId> ids_;  // Ascending, one per node.
  std::vector<double> depths_;   // Of what each sees.
  PoseGraph graph_;
};

}  // namespace

LoopPoseGraph optimize_loop(const Map& map, const LoopEdge& loop) {
  const EssentialGraph links(map);
  Surroundings part(links, map, loop);
  for (std::size_t size = kFirstPart;; size *= kGrowth) {
    part.grow(size);
    PartGraph graph(map, links, part);
    const double chi_squared = graph.close(loop);
    if (part.rim().empty() || graph.strain_at_rim() <= kMaxStrain) {
      return {graph.correction(), chi_squared};
    }
  }
}

}  // namespace waymark

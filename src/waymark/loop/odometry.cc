// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/odometry.h"

#include <algorithm>
#include <numeric>

#include "waymark/loop/drift.h"
#include "waymark/optimize/outlier_edges.h"
#include "waymark/optimize/pose_graph.h"

namespace waymark {
namespace {

/// Standard deviations of a step from one keyframe to the next, that of the translation in parts of
/// the depth of what is seen. Odometry errs for longer in one direction: three times as much as the
/// steps of a map show.
constexpr double kStepTranslation = 0.015;
constexpr double kStepRotationRad = 0.006;
constexpr double kStepLogScale = 0.015;
/// The same of a loop.
constexpr double kLoopTranslation = 0.01;
constexpr double kLoopRotationRad = 0.004;
constexpr double kLoopLogScale = 0.01;

constexpr std::uint32_t kNoNode = UINT32_MAX;

/// Odometry and loops of a sub-map. Lengths of a node are in its units before any correction.
class OdometryGraph {
 public:
  OdometryGraph(const Map& map, SubmapId submap)
      : map_(map), node_of_keyframe_(map.odometry().end_id().value, kNoNode) {
    graph_.is_scale_free = !map.submaps()[submap.value].is_metric;
    map.odometry().for_each([&](KeyframeId id, const OdometryNode&) {
      if (map.keyframes().at(map.resolve(id)).submap != submap) return;
      node_of_keyframe_[id.value] = static_cast<std::uint32_t>(ids_.size());
      ids_.push_back(id);
    });
    graph_.node_from_world.resize(ids_.size());
    graph_.is_fixed.assign(ids_.size(), 0);
    const KeyframeId root = map.submaps()[submap.value].root;
    if (node_of(root) != kNoNode) graph_.is_fixed[node_of(root)] = 1;
    is_placed_.assign(ids_.size(), 0);
    part_.resize(ids_.size());
    std::iota(part_.begin(), part_.end(), 0u);
    for (std::uint32_t node = 0; node < ids_.size(); ++node) {
      place(node);
      add_step(node);
    }
  }

  /// Whether both ends are there. The first that ties what odometry does not is how sub-maps were
  /// joined: the part moves there, and nothing can contradict that.
  bool add_loop(const LoopEdge& loop, bool is_robust) {
    if (node_of(loop.from) == kNoNode || node_of(loop.to) == kNoNode) return false;
    PoseGraphEdge edge;
    edge.from = node_of(loop.from);
    edge.to = node_of(loop.to);
    edge.to_from_from = loop.to_from_from;
    edge.sigma_translation = kLoopTranslation * noted(loop.to).depth;
    edge.sigma_rotation_rad = kLoopRotationRad;
    edge.sigma_log_scale = kLoopLogScale;
    const bool is_join = part_of(edge.from) != part_of(edge.to);
    if (is_join) join(edge);
    edge.is_robust = is_robust && !is_join;
    graph_.edges.push_back(edge);
    return true;
  }

  PoseGraph& graph() { return graph_; }

  /// Of the keyframes that are still there.
  MapCorrection correction() const {
    MapCorrection correction;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      const Keyframe* keyframe = map_.keyframes().find(ids_[i]);
      if (!keyframe) continue;
      const Sim3& node = graph_.node_from_world[i];
      // A node keeps its lengths, of which one is now 1 / scale of the world's.
      correction.keyframes.push_back({ids_[i],
                                      {node.rotation, node.translation / node.scale},
                                      1.0 / (node.scale * keyframe->applied_scale)});
    }
    return correction;
  }

 private:
  std::uint32_t node_of(KeyframeId id) const {
    return id.is_valid() && id.value < node_of_keyframe_.size() ? node_of_keyframe_[id.value]
                                                                : kNoNode;
  }

  std::uint32_t parent_of(std::uint32_t node) const { return node_of(noted(ids_[node]).parent); }

  const OdometryNode& noted(KeyframeId id) const { return map_.odometry().at(id); }

  /// A node and what is above it, by the way from the top of its tree; that is where the map has
  /// it.
  void place(std::uint32_t node) {
    std::vector<std::uint32_t> way;
    while (!is_placed_[node] && parent_of(node) != kNoNode && !graph_.is_fixed[node]) {
      way.push_back(node);
      node = parent_of(node);
    }
    if (!is_placed_[node]) {
      graph_.node_from_world[node] = as_mapped(ids_[node]);
      is_placed_[node] = 1;
    }
    for (auto below = way.rbegin(); below != way.rend(); node = *below++) {
      graph_.node_from_world[*below] =
          noted(ids_[*below]).rig_from_parent * graph_.node_from_world[node];
      is_placed_[*below] = 1;
    }
  }

  Sim3 as_mapped(KeyframeId id) const {
    const Keyframe* keyframe = map_.keyframes().find(id);
    if (!keyframe) return {};
    const double scale = keyframe->applied_scale;
    const Rigid3& rig_from_world = keyframe->rig_from_world;
    return {rig_from_world.rotation, rig_from_world.translation / scale, 1.0 / scale};
  }

  void add_step(std::uint32_t node) {
    if (parent_of(node) == kNoNode) return;
    const OdometryNode& step = noted(ids_[node]);
    PoseGraphEdge edge;
    edge.from = parent_of(node);
    edge.to = node;
    edge.to_from_from = step.rig_from_parent;
    edge.sigma_translation = kStepTranslation * step.depth;
    edge.sigma_rotation_rad = kStepRotationRad;
    edge.sigma_log_scale = kStepLogScale;
    graph_.edges.push_back(edge);
    part_[part_of(edge.from)] = part_of(edge.to);
  }

  std::uint32_t part_of(std::uint32_t node) {
    while (part_[node] != node) node = part_[node] = part_[part_[node]];
    return node;
  }

  /// Moves the part of one end, that without the root, to where the edge has it.
  void join(const PoseGraphEdge& edge) {
    std::vector<Sim3>& nodes = graph_.node_from_world;
    const auto root = std::ranges::find(graph_.is_fixed, std::uint8_t{1});
    const bool stays_to =
        root != graph_.is_fixed.end() &&
        part_of(static_cast<std::uint32_t>(root - graph_.is_fixed.begin())) == part_of(edge.to);
    const std::uint32_t end = stays_to ? edge.from : edge.to;
    const Sim3 moved = stays_to ? edge.to_from_from.inverse() * nodes[edge.to]
                                : edge.to_from_from * nodes[edge.from];
    const Sim3 old_world_from_new_world = nodes[end].inverse() * moved;
    for (std::uint32_t node = 0; node < nodes.size(); ++node) {
      if (part_of(node) == part_of(end)) nodes[node] = nodes[node] * old_world_from_new_world;
    }
    part_[part_of(edge.from)] = part_of(edge.to);
  }

  const Map& map_;
  std::vector<std::uint32_t> node_of_keyframe_;
  std::vector<KeyframeId> ids_;  // Ascending, one per node.
  std::vector<std::uint8_t> is_placed_;
  std::vector<std::uint32_t> part_;  // Per node: towards the node that stands for its part.
  PoseGraph graph_;
};

OdometryNode node_of(const Map& map, KeyframeId id, const Keyframe& keyframe) {
  const double scale = keyframe.applied_scale;
  OdometryNode node;
  const double depth = median_depth(map, id) / scale;
  if (depth > 0.0) node.depth = depth;
  node.parent = keyframe.parent;
  if (const Keyframe* parent = map.keyframes().find(node.parent)) {
    const Rigid3 rigid = keyframe.rig_from_world * parent->rig_from_world.inverse();
    node.rig_from_parent = {
        rigid.rotation, rigid.translation / scale, parent->applied_scale / scale};
  }
  return node;
}

}  // namespace

void note_odometry(Map& map, KeyframeId first) {
  for (KeyframeId id = first; id < map.keyframes().end_id(); ++id.value) {
    const Keyframe* keyframe = map.keyframes().find(id);
    if (!keyframe || map.odometry().contains(id)) continue;
    map.note_odometry(id, node_of(map, id, *keyframe));
  }
}

LoopEdge as_measured(const Map& map, const LoopEdge& loop) {
  const double from_scale = map.keyframes().at(loop.from).applied_scale;
  const double to_scale = map.keyframes().at(loop.to).applied_scale;
  LoopEdge measured = loop;
  measured.to_from_from.translation /= to_scale;
  measured.to_from_from.scale *= from_scale / to_scale;
  return measured;
}

std::vector<std::uint8_t> choose_loops(const Map& map,
                                       SubmapId submap,
                                       std::span<const LoopEdge> loops,
                                       std::size_t num_believed) {
  OdometryGraph graph(map, submap);
  const std::size_t num_steps = graph.graph().edges.size();
  std::vector<std::size_t> is_there;  // The loops that have edges, in their order.
  OutlierEdgeOptions options;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (!graph.add_loop(loops[i], true)) continue;
    if (i < num_believed) options.believed.push_back(num_steps + is_there.size());
    is_there.push_back(i);
  }
  const std::vector<std::uint8_t> edge_is_on = reject_outlier_edges(graph.graph(), options);
  std::vector<std::uint8_t> is_on(loops.size(), 1);
  for (std::size_t k = 0; k < is_there.size(); ++k) is_on[is_there[k]] = edge_is_on[num_steps + k];
  return is_on;
}

MapCorrection place_by_odometry(const Map& map, SubmapId submap, std::span<const LoopEdge> loops) {
  OdometryGraph graph(map, submap);
  for (const LoopEdge& loop : loops) graph.add_loop(loop, false);
  optimize_pose_graph(graph.graph(), {});
  return graph.correction();
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/path_uncertainty.h"

#include <cmath>
#include <limits>
#include <utility>

#include "waymark/optimize/pose_graph_solver.h"

namespace waymark {
namespace {

constexpr double kNumComponents = 7.0;

}  // namespace

PathUncertainty::PathUncertainty(const PoseGraph& graph, std::span<const std::uint8_t> is_trusted)
    : graph_(graph), above_(graph.node_from_world.size(), kNone), depth_(above_.size(), 0) {
  std::vector<std::vector<std::uint32_t>> edges_of_node(above_.size());
  for (std::uint32_t i = 0; i < graph.edges.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    if (!is_trusted[i] || !is_usable(edge, graph.node_from_world)) continue;
    edges_of_node[edge.from].push_back(i);
    edges_of_node[edge.to].push_back(i);
  }
  std::vector<std::uint8_t> is_reached(above_.size(), 0);
  for (std::uint32_t root = 0; root < above_.size(); ++root) {
    if (!is_reached[root]) spread_from(root, edges_of_node, is_reached);
  }
}

double PathUncertainty::expected_residual(const PoseGraphEdge& edge) const {
  std::uint32_t a = edge.from;
  std::uint32_t b = edge.to;
  double sum = kNumComponents;
  while (a != b) {
    std::uint32_t& lower = depth_[a] >= depth_[b] ? a : b;
    if (above_[lower] == kNone) return std::numeric_limits<double>::infinity();
    const PoseGraphEdge& step = graph_.edges[above_[lower]];
    sum += squared_share(step, edge);
    lower = step.from == lower ? step.to : step.from;
  }
  return std::sqrt(sum);
}

/// Breadth first.
void PathUncertainty::spread_from(std::uint32_t root,
                                  std::span<const std::vector<std::uint32_t>> edges_of_node,
                                  std::vector<std::uint8_t>& is_reached) {
  is_reached[root] = 1;
  std::vector<std::uint32_t> queue = {root};
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::uint32_t node = queue[next];
    for (const std::uint32_t i : edges_of_node[node]) {
      const PoseGraphEdge& edge = graph_.edges[i];
      const std::uint32_t other = edge.from == node ? edge.to : edge.from;
      if (std::exchange(is_reached[other], 1)) continue;
      above_[other] = i;
      depth_[other] = depth_[node] + 1;
      queue.push_back(other);
    }
  }
}

/// What the error of a step adds to the expected square of the residual of an edge.
double PathUncertainty::squared_share(const PoseGraphEdge& step, const PoseGraphEdge& edge) const {
  const Sim3& to_from_world = graph_.node_from_world[edge.to];
  const Sim3 to_from_step = to_from_world * graph_.node_from_world[step.to].inverse();
  const double lever = to_from_step.translation.squaredNorm();
  const auto square = [](double value) { return value * value; };
  const double turn = square(step.sigma_rotation_rad);
  const double growth = graph_.is_scale_free ? square(step.sigma_log_scale) : 0.0;
  const double move = 3.0 * square(to_from_step.scale * step.sigma_translation);
  return (move + lever * (2.0 * turn + growth)) / square(edge.sigma_translation) +
         3.0 * turn / square(edge.sigma_rotation_rad) + growth / square(edge.sigma_log_scale);
}

}  // namespace waymark

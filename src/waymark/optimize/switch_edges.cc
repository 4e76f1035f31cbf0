// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/switch_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/optimize/pose_graph_solver.h"

namespace waymark {
namespace {

/// Edges that may be on begin with a loss so many times as wide as the residual that is expected,
/// then it gets narrower by this factor.
constexpr double kFirstWidth = 2.0;
constexpr double kNarrowing = 2.0;
/// Each pass takes edges whose expected residual may be twice as long; so many at most.
constexpr double kReachGrowth = 2.0;
constexpr int kMaxPasses = 20;
/// Steps at the narrowest loss, and the share of the cost that is not worth one.
constexpr int kLastIterations = 20;
constexpr double kNegligibleForSwitching = 1e-5;

/// What the edges that are trusted say of how far the ends of the others may lie off: along the
/// ways of a spanning tree of them.
class TrustedWays {
 public:
  TrustedWays(const PoseGraph& graph, std::span<const std::uint8_t> is_trusted)
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

  /// Length that the residual of an edge may be expected to have, in standard deviations; infinite
  /// where no way leads from one end to the other.
  double expected_residual(const PoseGraphEdge& edge) const {
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

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  static constexpr double kNumComponents = 7.0;

  /// Breadth first.
  void spread_from(std::uint32_t root,
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
  double squared_share(const PoseGraphEdge& step, const PoseGraphEdge& edge) const {
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

  const PoseGraph& graph_;
  std::vector<std::uint32_t> above_;  // Edge that leads towards the root, per node.
  std::vector<std::uint32_t> depth_;  // Per node.
};

/// Per edge: whether it agrees with the nodes.
std::vector<std::uint8_t> agreeing(const PoseGraph& graph, double max_residual) {
  std::vector<std::uint8_t> is_on;
  for (const PoseGraphEdge& edge : graph.edges) {
    is_on.push_back(!edge.is_robust ||
                    (is_usable(edge, graph.node_from_world) &&
                     residual_of(edge, graph.node_from_world).norm() < max_residual));
  }
  return is_on;
}

/// Expected residuals of the edges that may be on, by the ways along those that are; at least 1. Of
/// the others 0.
std::vector<double> expect_residuals(const PoseGraph& graph, std::span<const std::uint8_t> is_on) {
  const TrustedWays ways(graph, is_on);
  std::vector<double> expected(graph.edges.size(), 0.0);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    if (!edge.is_robust || !is_usable(edge, graph.node_from_world)) continue;
    const double widest = residual_of(edge, graph.node_from_world).norm();
    expected[i] = std::max(std::min(ways.expected_residual(edge), widest), 1.0);
  }
  return expected;
}

/// Finds out which robust edges agree, from those of short ways to those of long ones.
template <int kDimension>
class EdgeSwitcher {
 public:
  EdgeSwitcher(PoseGraph& graph, const SwitchOptions& options)
      : graph_(graph), narrowest_(options.max_residual), solver_(graph) {
    for (const PoseGraphEdge& edge : graph.edges) is_on_.push_back(!edge.is_robust);
    for (const std::size_t edge : options.believed) is_on_.at(edge) = 1;
  }

  std::vector<std::uint8_t> switch_edges() {
    double reach = 0.0;
    for (int pass = 0; pass < kMaxPasses; ++pass) {
      const std::vector<double> expected = expect_residuals(graph_, is_on_);
      reach = std::max(kReachGrowth * reach, least_of_undecided(expected));
      const bool is_last = reach >= *std::ranges::max_element(expected);
      admit(expected, reach);
      narrow_down();
      const bool is_same = take_agreeing();
      if (is_last && is_same) break;
    }
    return is_on_;
  }

 private:
  double least_of_undecided(std::span<const double> expected) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!is_on_[i] && expected[i] > 0.0) least = std::min(least, expected[i]);
    }
    return std::isfinite(least) ? least : narrowest_;
  }

  /// Sets the first widths of the losses: 0 for what is out of reach.
  void admit(std::span<const double> expected, double reach) {
    widths_.assign(expected.size(), 0.0);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (is_on_[i]) {
        widths_[i] = narrowest_;
      } else if (expected[i] > 0.0 && expected[i] <= reach) {
        widths_[i] = std::max(kFirstWidth * expected[i], narrowest_);
      }
    }
  }

  /// Returns whether that changes nothing.
  bool take_agreeing() {
    std::vector<std::uint8_t> is_on = agreeing(graph_, narrowest_);
    for (std::size_t i = 0; i < is_on.size(); ++i) {
      if (widths_[i] == 0.0 && graph_.edges[i].is_robust) is_on[i] = 0;
    }
    return std::exchange(is_on_, is_on) == is_on;
  }

  void narrow_down() {
    std::vector<double> widths = widths_;
    while (*std::ranges::max_element(widths) > narrowest_) {
      solver_.set_loss(geman_mcclure, widths);
      solver_.minimize(1, kNegligibleForSwitching);
      for (double& width : widths) {
        if (width > 0.0) width = std::max(width / kNarrowing, narrowest_);
      }
    }
    solver_.set_loss(geman_mcclure, widths);
    solver_.minimize(kLastIterations, kNegligibleForSwitching);
  }

  PoseGraph& graph_;
  const double narrowest_;
  PoseGraphSolver<kDimension> solver_;
  std::vector<std::uint8_t> is_on_;  // Per edge.
  std::vector<double> widths_;       // Of the losses of a pass at first, per edge; 0: left out.
};

}  // namespace

std::vector<std::uint8_t> switch_edges(PoseGraph& graph, const SwitchOptions& options) {
  WAYMARK_CHECK(graph.is_fixed.size() == graph.node_from_world.size());
  if (graph.edges.empty()) return {};
  if (graph.is_scale_free) return EdgeSwitcher<7>(graph, options).switch_edges();
  return EdgeSwitcher<6>(graph, options).switch_edges();
}

}  // namespace waymark

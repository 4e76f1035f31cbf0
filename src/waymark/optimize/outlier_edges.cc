// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/outlier_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/optimize/path_uncertainty.h"
#include "waymark/optimize/pose_graph_solver.h"

namespace waymark {
namespace {

/// Edges that may be on begin with a loss so many times as wide as the residual that is expected,
/// then it gets narrower by this factor.
constexpr double kFirstWidth = 2.0;
constexpr double kNarrowing = 2.0;
/// Each pass takes edges whose expected residual may be twice as long, or as long as the next edge
/// needs; so many at most.
constexpr double kReachGrowth = 2.0;
constexpr int kMaxPasses = 20;
/// Steps at the narrowest loss, and the share of the cost that is not worth one.
constexpr int kLastIterations = 20;
constexpr double kNegligibleForRejection = 1e-5;

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
  const PathUncertainty ways(graph, is_on);
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
class OutlierEdgeRejector {
 public:
  OutlierEdgeRejector(PoseGraph& graph, const OutlierEdgeOptions& options)
      : graph_(graph), narrowest_(options.max_residual), solver_(graph) {
    for (const PoseGraphEdge& edge : graph.edges) is_on_.push_back(!edge.is_robust);
    for (const std::size_t edge : options.believed) is_on_.at(edge) = 1;
  }

  std::vector<std::uint8_t> reject_outlier_edges() {
    double reach = 0.0;
    bool is_settled = true;
    for (int pass = 0; pass < kMaxPasses; ++pass) {
      const std::vector<double> expected = expect_residuals(graph_, is_on_);
      // Where nothing changed, what is within reach is decided.
      const double next = least_beyond(reach, expected);
      if (pass > 0 && is_settled && !std::isfinite(next)) break;
      reach = std::max(kReachGrowth * reach, is_settled && std::isfinite(next) ? next : 0.0);
      admit(expected, reach);
      narrow_down();
      is_settled = take_agreeing();
    }
    return is_on_;
  }

 private:
  /// Of the edges that are off; infinite where there are none.
  double least_beyond(double reach, std::span<const double> expected) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!is_on_[i] && expected[i] > reach) least = std::min(least, expected[i]);
    }
    return least;
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
      solver_.minimize(1, kNegligibleForRejection);
      for (double& width : widths) {
        if (width > 0.0) width = std::max(width / kNarrowing, narrowest_);
      }
    }
    solver_.set_loss(geman_mcclure, widths);
    solver_.minimize(kLastIterations, kNegligibleForRejection);
  }

  PoseGraph& graph_;
  const double narrowest_;
  PoseGraphSolver<kDimension> solver_;
  std::vector<std::uint8_t> is_on_;  // Per edge.
  std::vector<double> widths_;       // Of the losses of a pass at first, per edge; 0: left out.
};

}  // namespace

std::vector<std::uint8_t> reject_outlier_edges(PoseGraph& graph,
                                               const OutlierEdgeOptions& options) {
  WAYMARK_CHECK(graph.is_fixed.size() == graph.node_from_world.size());
  if (graph.edges.empty()) return {};
  if (graph.is_scale_free) return OutlierEdgeRejector<7>(graph, options).reject_outlier_edges();
  return OutlierEdgeRejector<6>(graph, options).reject_outlier_edges();
}

}  // namespace waymark

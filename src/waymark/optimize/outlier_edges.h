// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/optimize/pose_graph.h"

namespace waymark {

/// How false loops are told from true ones.
struct OutlierEdgeOptions {
  /// Length of a residual, in standard deviations, from which on a robust edge is not believed: the
  /// root of the 99 % quantile of chi-square with 7 degrees of freedom.
  double max_residual = 4.3;
  /// Robust edges that were on before, by index: they begin as such.
  std::vector<std::size_t> believed = {};
};

/// Which edges agree with each other, 1 or 0 per edge: all that are not robust, and those robust
/// ones that are true as far as the others tell. Nodes begin where the edges that are not robust
/// have them and end where the agreeing ones put them, roughly: the rest is for
/// optimize_pose_graph() with only these.
/// Graduated non-convexity with the loss of Geman and McClure (Yang et al. 2020). The loss of each
/// edge begins as wide as the way between its ends, along what is not robust or on by now, can be
/// wrong by. Edges of short ways are decided first: with them the long ones have become shorter,
/// while at a loss as wide as these would need, false ones count as much as true ones.
/// Same input, same bits.
std::vector<std::uint8_t> reject_outlier_edges(PoseGraph& graph, const OutlierEdgeOptions& options);

}  // namespace waymark

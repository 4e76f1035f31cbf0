// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/geometry/sim3.h"

namespace waymark {

/// A measured relative similarity of two nodes. Its residual is
/// log(to_from_from * from_from_world * to_from_world^-1), divided by the standard deviations of
/// its components (Strasdat et al. 2010). Lengths are in the units of node `to`, which do
/// not change with its scale in the world.
struct PoseGraphEdge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  Sim3 to_from_from;
  /// Greater than 0; infinity for what is not measured.
  double sigma_translation = 1.0;
  double sigma_rotation_rad = 1.0;
  double sigma_log_scale = 1.0;
  /// Discounted by Huber's loss if it contradicts the others, as a false loop would.
  bool is_robust = false;
};

struct PoseGraph {
  std::vector<Sim3> node_from_world;
  std::vector<std::uint8_t> is_fixed;  ///< Per node.
  std::vector<PoseGraphEdge> edges;
  /// Otherwise each node keeps its scale, which in a metric map is 1: the graph is one over SE(3).
  bool is_scale_free = true;
  /// The nodes that keep their scale where others are free. Per node; empty where there are none.
  std::vector<std::uint8_t> keeps_scale;
};

struct PoseGraphOptions {
  int max_iterations = 100;
  /// Length of a residual, in standard deviations, from which Huber's loss of robust edges is
  /// linear; the default is the root of the 95 % quantile of chi-square with 7 degrees of freedom.
  double robust_scale = 3.75;
  /// Iterations end when the next one would lower the cost by less than this share of it.
  double negligible_share = 1e-10;
};

/// Costs are half the robust sum of squared residuals over the used edges.
struct PoseGraphSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int num_iterations = 0;
  bool is_converged = false;
  /// Edges of a node to itself or with values that are not finite (their own or of their nodes),
  /// which are left out.
  std::size_t num_unused_edges = 0;
};

/// Residual of an edge in standard deviations and its derivatives by left perturbations of both
/// nodes.
struct PoseGraphResidual {
  Vector7d value;
  Matrix7d by_from;
  Matrix7d by_to;
};
PoseGraphResidual pose_graph_residual(const PoseGraphEdge& edge,
                                      const Sim3& from_from_world,
                                      const Sim3& to_from_world);

/// Moves the nodes that are not fixed to the least cost by Levenberg-Marquardt. The linear systems
/// are solved by a sparse Cholesky decomposition (BlockCholesky), ordered once. Nodes without edges
/// stay; with no node fixed, the whole stays about where it is. On the caller's thread, all sums in
/// the order of the edges: same input, same bits.
PoseGraphSummary optimize_pose_graph(PoseGraph& graph, const PoseGraphOptions& options);

}  // namespace waymark

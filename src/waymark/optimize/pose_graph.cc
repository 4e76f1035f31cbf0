// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose_graph.h"

#include "waymark/base/check.h"
#include "waymark/optimize/pose_graph_solver.h"

namespace waymark {
namespace {

template <int kDimension>
PoseGraphSummary minimize_with_huber(PoseGraph& graph, const PoseGraphOptions& options) {
  PoseGraphSolver<kDimension> solver(graph);
  solver.set_loss(huber, std::vector<double>(graph.edges.size(), options.robust_scale));
  return solver.minimize(options.max_iterations, options.negligible_share);
}

}  // namespace

PoseGraphResidual pose_graph_residual(const PoseGraphEdge& edge,
                                      const Sim3& from_from_world,
                                      const Sim3& to_from_world) {
  const Sim3 error = edge.to_from_from * from_from_world * to_from_world.inverse();
  const Vector7d weights = inverse_sigmas(edge);
  const Vector7d tangent = error.log();
  const Matrix7d weighted_jacobian = weights.asDiagonal() * sim3_left_jacobian_inverse(tangent);
  PoseGraphResidual residual;
  residual.value = weights.cwiseProduct(tangent);
  // M exp(xi) = exp(Ad(M) xi) M, and E exp(-xi) = exp(-Ad(E) xi) E.
  residual.by_from.noalias() = weighted_jacobian * edge.to_from_from.adjoint();
  residual.by_to.noalias() = -weighted_jacobian * error.adjoint();
  return residual;
}

PoseGraphSummary optimize_pose_graph(PoseGraph& graph, const PoseGraphOptions& options) {
  WAYMARK_CHECK(graph.is_fixed.size() == graph.node_from_world.size());
  WAYMARK_CHECK(graph.keeps_scale.empty() || graph.keeps_scale.size() == graph.is_fixed.size());
  if (graph.is_scale_free) return minimize_with_huber<7>(graph, options);
  return minimize_with_huber<6>(graph, options);
}

}  // namespace waymark

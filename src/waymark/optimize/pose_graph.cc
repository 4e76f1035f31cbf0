// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "waymark/base/check.h"
#include "waymark/base/thread_pool.h"
#include "waymark/optimize/levenberg_marquardt.h"
#include "waymark/optimize/pose_graph_system.h"
#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

/// Iterations end when the next step would lower the cost by less than this share of it, or by less
/// than the absolute value, in squared standard deviations.
constexpr double kNegligibleShare = 1e-10;
constexpr double kNegligibleDecrease = 1e-12;
/// Damping at which no step is left to try, and that which keeps a graph without fixed nodes from
/// drifting along with rounding.
constexpr double kMaxGraphDamping = 1e16;
constexpr double kMinDamping = 1e-10;
/// Deviation from 1 of the norm of a quaternion that is still taken for a rotation.
constexpr double kMaxNormError = 1e-3;

bool is_valid(const Sim3& similarity) {
  return similarity.translation.allFinite() && std::isfinite(similarity.scale) &&
         similarity.scale > 0.0 && std::abs(similarity.rotation.norm() - 1.0) < kMaxNormError;
}

Vector7d inverse_sigmas(const PoseGraphEdge& edge) {
  Vector7d result;
  result.head<3>().setConstant(1.0 / edge.sigma_translation);
  result.segment<3>(3).setConstant(1.0 / edge.sigma_rotation_rad);
  result[6] = 1.0 / edge.sigma_log_scale;
  return result;
}

Vector7d residual_of(const PoseGraphEdge& edge, std::span<const Sim3> node_from_world) {
  const Sim3 error =
      edge.to_from_from * node_from_world[edge.from] * node_from_world[edge.to].inverse();
  return inverse_sigmas(edge).cwiseProduct(error.log());
}

bool is_usable(const PoseGraphEdge& edge, std::span<const Sim3> node_from_world) {
  const double least_sigma =
      std::min({edge.sigma_translation, edge.sigma_rotation_rad, edge.sigma_log_scale});
  const bool is_measured = edge.from != edge.to && least_sigma > 0.0 &&
                           is_valid(edge.to_from_from) && is_valid(node_from_world[edge.from]) &&
                           is_valid(node_from_world[edge.to]);
  return is_measured && std::isfinite(residual_of(edge, node_from_world).squaredNorm());
}

RobustValue robust_value(const PoseGraphEdge& edge, double squared_residual, double robust_scale) {
  if (!edge.is_robust) return {squared_residual, 1.0};
  return huber(squared_residual, robust_scale);
}

/// Each node has kDimension unknowns: the scale is the last of seven.
template <int kDimension>
class PoseGraphSolver {
 public:
  PoseGraphSolver(PoseGraph& graph, const PoseGraphOptions& options)
      : graph_(graph), options_(options) {
    for (const PoseGraphEdge& edge : graph.edges) {
      WAYMARK_CHECK(std::max(edge.from, edge.to) < graph.node_from_world.size());
      if (is_usable(edge, graph.node_from_world)) edges_.push_back(edge);
    }
    for (const std::uint8_t is_fixed : graph.is_fixed) {
      slot_of_node_.push_back(is_fixed ? kNoPoseGraphSlot : num_slots_++);
    }
    std::vector<SlotPair> pairs;
    for (const PoseGraphEdge& edge : edges_) {
      pairs.push_back({slot_of_node_[edge.from], slot_of_node_[edge.to]});
    }
    system_.emplace(num_slots_, pairs);
  }

  PoseGraphSummary minimize() {
    PoseGraphSummary summary;
    summary.num_unused_edges = graph_.edges.size() - edges_.size();
    double cost = cost_at(graph_.node_from_world);
    summary.initial_cost = summary.final_cost = 0.5 * cost;
    Damping damping(1e-6, kMinDamping);
    bool should_linearize = true;
    while (num_slots_ > 0 && summary.num_iterations < options_.max_iterations) {
      if (should_linearize) linearize();
      ++summary.num_iterations;
      const double decrease =
          damping.value() < kMaxGraphDamping ? system_->solve(damping.value(), threads_) : 0.0;
      should_linearize = false;
      if (std::isfinite(decrease)) {
        if (!(decrease > kNegligibleShare * cost + kNegligibleDecrease)) {
          summary.is_converged = damping.value() < 1.0;
          break;
        }
        const std::vector<Sim3> candidate = moved();
        const double next_cost = cost_at(candidate);
        const double gain = (cost - next_cost) / decrease;
        if (gain > 0.0) {
          graph_.node_from_world = candidate;
          cost = next_cost;
          damping.accept(gain);
          should_linearize = true;
          continue;
        }
      }
      damping.reject();
    }
    summary.final_cost = 0.5 * cost;
    return summary;
  }

 private:
  double cost_at(std::span<const Sim3> node_from_world) const {
    double sum = 0.0;
    for (const PoseGraphEdge& edge : edges_) {
      const double squared = residual_of(edge, node_from_world).squaredNorm();
      sum += robust_value(edge, squared, options_.robust_scale).loss;
    }
    return sum;
  }

  void linearize() {
    system_->clear();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const PoseGraphEdge& edge = edges_[i];
      const PoseGraphResidual residual = pose_graph_residual(
          edge, graph_.node_from_world[edge.from], graph_.node_from_world[edge.to]);
      const double squared = residual.value.squaredNorm();
      const double weight = robust_value(edge, squared, options_.robust_scale).weight;
      system_->add(i, residual, weight);
    }
  }

  /// The nodes after the step of the system.
  std::vector<Sim3> moved() const {
    std::vector<Sim3> result = graph_.node_from_world;
    for (std::size_t node = 0; node < result.size(); ++node) {
      const std::uint32_t slot = slot_of_node_[node];
      if (slot == kNoPoseGraphSlot || !system_->has_edges(slot)) continue;
      Vector7d tangent = Vector7d::Zero();
      tangent.head<kDimension>() = system_->step(slot);
      const double scale = result[node].scale;
      result[node] = Sim3::exp(tangent) * result[node];
      if (kDimension == 6) result[node].scale = scale;
    }
    return result;
  }

  PoseGraph& graph_;
  const PoseGraphOptions& options_;
  std::vector<PoseGraphEdge> edges_;  // The used ones.
  std::vector<std::uint32_t> slot_of_node_;
  std::uint32_t num_slots_ = 0;
  std::optional<PoseGraphSystem<kDimension>> system_;
  ThreadPool threads_{1};
};

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
  if (graph.is_scale_free) return PoseGraphSolver<7>(graph, options).minimize();
  return PoseGraphSolver<6>(graph, options).minimize();
}

}  // namespace waymark

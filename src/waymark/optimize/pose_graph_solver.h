// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/thread_pool.h"
#include "waymark/geometry/damping.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/optimize/pose_graph.h"
#include "waymark/optimize/pose_graph_system.h"
#include "waymark/solver/levenberg_marquardt.h"
#include "waymark/solver/residual.h"

namespace waymark {

/// Iterations end when the next step would lower the cost by less, in squared standard deviations.
inline constexpr double kNegligibleDecrease = 1e-12;
/// Damping at which no step is left to try, and that which keeps a graph without fixed nodes from
/// drifting along with rounding.
inline constexpr double kMaxGraphDamping = 1e16;
inline constexpr double kMinDamping = 1e-10;
/// Deviation from 1 of the norm of a quaternion that is still taken for a rotation.
inline constexpr double kMaxNormError = 1e-3;

inline bool is_valid(const Sim3& similarity) {
  return similarity.translation.allFinite() && std::isfinite(similarity.scale) &&
         similarity.scale > 0.0 && std::abs(similarity.rotation.norm() - 1.0) < kMaxNormError;
}

inline Vector7d inverse_sigmas(const PoseGraphEdge& edge) {
  Vector7d result;
  result.head<3>().setConstant(1.0 / edge.sigma_translation);
  result.segment<3>(3).setConstant(1.0 / edge.sigma_rotation_rad);
  result[6] = 1.0 / edge.sigma_log_scale;
  return result;
}

inline Vector7d residual_of(const PoseGraphEdge& edge, std::span<const Sim3> node_from_world) {
  const Sim3 error =
      edge.to_from_from * node_from_world[edge.from] * node_from_world[edge.to].inverse();
  return inverse_sigmas(edge).cwiseProduct(error.log());
}

inline bool is_usable(const PoseGraphEdge& edge, std::span<const Sim3> node_from_world) {
  const double least_sigma =
      std::min({edge.sigma_translation, edge.sigma_rotation_rad, edge.sigma_log_scale});
  const bool is_measured = edge.from != edge.to && least_sigma > 0.0 &&
                           is_valid(edge.to_from_from) && is_valid(node_from_world[edge.from]) &&
                           is_valid(node_from_world[edge.to]);
  return is_measured && std::isfinite(residual_of(edge, node_from_world).squaredNorm());
}

/// The loss of robust edges, for a squared length in standard deviations and a scale.
using RobustLoss = RobustValue (*)(double, double);

/// Each node has kDimension unknowns: the scale is the last of seven.
template <int kDimension>
class PoseGraphSolver {
 public:
  explicit PoseGraphSolver(PoseGraph& graph) : graph_(graph) {
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
      const PoseGraphEdge& edge = graph.edges[i];
      WAYMARK_CHECK(std::max(edge.from, edge.to) < graph.node_from_world.size());
      if (!is_usable(edge, graph.node_from_world)) continue;
      edges_.push_back(edge);
      number_of_edge_.push_back(i);
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

  /// The loss of robust edges, from now on.
  void set_loss(RobustLoss loss, std::vector<double> scale_of_edge) {
    loss_ = loss;
    loss_scales_ = std::move(scale_of_edge);
  }

  PoseGraphSummary minimize(int max_iterations, double negligible_share) {
    PoseGraphSummary summary;
    summary.num_unused_edges = graph_.edges.size() - edges_.size();
    double cost = cost_at(graph_.node_from_world);
    summary.initial_cost = summary.final_cost = 0.5 * cost;
    Damping damping(1e-6, kMinDamping);
    bool should_linearize = true;
    while (num_slots_ > 0 && summary.num_iterations < max_iterations) {
      if (should_linearize) linearize();
      ++summary.num_iterations;
      const double decrease =
          damping.value() < kMaxGraphDamping ? system_->solve(damping.value(), threads_) : 0.0;
      should_linearize = false;
      if (std::isfinite(decrease)) {
        if (!(decrease > negligible_share * cost + kNegligibleDecrease)) {
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
  RobustValue robust_value(std::size_t used, double squared_residual) const {
    if (!edges_[used].is_robust) return {squared_residual, 1.0};
    const double scale = loss_scales_[number_of_edge_[used]];
    if (!(scale > 0.0)) return {0.0, 0.0};
    return loss_(squared_residual, scale);
  }

  double cost_at(std::span<const Sim3> node_from_world) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      sum += robust_value(i, residual_of(edges_[i], node_from_world).squaredNorm()).loss;
    }
    return sum;
  }

  void linearize() {
    system_->clear();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const PoseGraphEdge& edge = edges_[i];
      PoseGraphResidual residual = pose_graph_residual(
          edge, graph_.node_from_world[edge.from], graph_.node_from_world[edge.to]);
      if (!graph_.keeps_scale.empty()) {
        if (graph_.keeps_scale[edge.from]) residual.by_from.col(6).setZero();
        if (graph_.keeps_scale[edge.to]) residual.by_to.col(6).setZero();
      }
      const double squared = residual.value.squaredNorm();
      system_->add(i, residual, robust_value(i, squared).weight);
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
  RobustLoss loss_ = huber;
  std::vector<double> loss_scales_;          // Per edge of the graph.
  std::vector<PoseGraphEdge> edges_;         // The used ones.
  std::vector<std::size_t> number_of_edge_;  // Of each of these in the graph.
  std::vector<std::uint32_t> slot_of_node_;
  std::uint32_t num_slots_ = 0;
  std::optional<PoseGraphSystem<kDimension>> system_;
  ThreadPool threads_{1};
};

}  // namespace waymark

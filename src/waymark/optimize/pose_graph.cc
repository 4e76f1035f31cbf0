// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "waymark/base/check.h"
#include "waymark/optimize/levenberg_marquardt.h"
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

constexpr std::uint32_t kNoPoseGraphSlot = UINT32_MAX;

/// The slots of the nodes of an edge; kNoPoseGraphSlot for one that is fixed.
struct SlotPair {
  std::uint32_t from;
  std::uint32_t to;
};

/// Normal equations of a pose graph: one block row of kDimension unknowns per slot, of which the
/// lower triangle is kept in compressed columns. The pattern and its ordering are found once.
template <int kDimension>
class PoseGraphSystem {
 public:
  using Block = Eigen::Matrix<double, kDimension, kDimension>;
  using Step = Eigen::Matrix<double, kDimension, 1>;

  PoseGraphSystem(std::uint32_t num_slots, std::span<const SlotPair> edges)
      : slots_(edges.begin(), edges.end()), rows_(num_slots), start_(num_slots) {
    for (std::uint32_t slot = 0; slot < num_slots; ++slot) rows_[slot].push_back(slot);
    for (const SlotPair& edge : slots_) {
      if (is_free(edge))
        rows_[std::min(edge.from, edge.to)].push_back(std::max(edge.from, edge.to));
    }
    std::size_t num_values = 0;
    for (std::uint32_t slot = 0; slot < num_slots; ++slot) {
      auto& rows = rows_[slot];
      std::sort(rows.begin(), rows.end());
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      start_[slot] = num_values;
      num_values += rows.size() * kDimension * kDimension;
    }
    make_pattern(num_values);
    has_edges_.assign(num_slots, 0);
    for (const SlotPair& edge : slots_) {
      for (const std::uint32_t slot : {edge.from, edge.to}) {
        if (slot != kNoPoseGraphSlot) has_edges_[slot] = 1;
      }
    }
    if (num_slots > 0) factor_.analyzePattern(hessian_);
  }

  bool has_edges(std::uint32_t slot) const { return has_edges_[slot] != 0; }

  void clear() {
    std::fill_n(hessian_.valuePtr(), hessian_.nonZeros(), 0.0);
    gradient_.setZero();
  }

  /// Adds an edge by its index in the span given to the constructor.
  void add(std::size_t edge, const PoseGraphResidual& residual, double weight) {
    const SlotPair& slots = slots_[edge];
    const Jacobian by_from = residual.by_from.template leftCols<kDimension>();
    const Jacobian by_to = residual.by_to.template leftCols<kDimension>();
    if (slots.from != kNoPoseGraphSlot) {
      block(slots.from, slots.from).noalias() += weight * by_from.transpose() * by_from;
      gradient(slots.from).noalias() += weight * by_from.transpose() * residual.value;
    }
    if (slots.to != kNoPoseGraphSlot) {
      block(slots.to, slots.to).noalias() += weight * by_to.transpose() * by_to;
      gradient(slots.to).noalias() += weight * by_to.transpose() * residual.value;
    }
    if (!is_free(slots)) return;
    if (slots.from > slots.to) {
      block(slots.from, slots.to).noalias() += weight * by_from.transpose() * by_to;
    } else {
      block(slots.to, slots.from).noalias() += weight * by_to.transpose() * by_from;
    }
  }

  /// Finds the step of Levenberg-Marquardt and returns by how much it lowers the sum of squares of
  /// the linear problem; not a number if there is no step.
  double solve(double damping) {
    constexpr double kGraphPriorInformation = 1e-9;
    const Eigen::VectorXd scale = hessian_.diagonal().array() + kGraphPriorInformation;
    Eigen::SparseMatrix<double> damped = hessian_;
    for (int k = 0; k < damped.outerSize(); ++k) damped.coeffRef(k, k) += damping * scale[k];
    factor_.factorize(damped);
    if (factor_.info() != Eigen::Success) return std::numeric_limits<double>::quiet_NaN();
    step_ = -factor_.solve(gradient_);
    return step_.dot(damping * scale.cwiseProduct(step_) - gradient_);
  }

  Step step(std::uint32_t slot) const {
    return step_.template segment<kDimension>(static_cast<int>(slot) * kDimension);
  }

 private:
  using Jacobian = Eigen::Matrix<double, 7, kDimension>;
  using BlockView = Eigen::Map<Block, 0, Eigen::OuterStride<>>;

  static bool is_free(const SlotPair& edge) {
    return edge.from != kNoPoseGraphSlot && edge.to != kNoPoseGraphSlot;
  }

  void make_pattern(std::size_t num_values) {
    const int size = static_cast<int>(rows_.size()) * kDimension;
    hessian_.resize(size, size);
    hessian_.resizeNonZeros(static_cast<int>(num_values));
    gradient_ = Eigen::VectorXd::Zero(size);
    int next = 0;
    for (int column = 0; column < size; ++column) {
      hessian_.outerIndexPtr()[column] = next;
      for (const std::uint32_t row : rows_[static_cast<std::size_t>(column / kDimension)]) {
        for (int k = 0; k < kDimension; ++k) {
          hessian_.innerIndexPtr()[next++] = static_cast<int>(row) * kDimension + k;
        }
      }
    }
    hessian_.outerIndexPtr()[size] = next;
  }

  /// row >= column; of a block on the diagonal, the upper half is written and never read.
  BlockView block(std::uint32_t row, std::uint32_t column) {
    const auto& rows = rows_[column];
    const auto position = std::lower_bound(rows.begin(), rows.end(), row) - rows.begin();
    double* first = hessian_.valuePtr() + start_[column] + position * kDimension;
    return BlockView(first,
                     Eigen::OuterStride<>(static_cast<std::ptrdiff_t>(rows.size()) * kDimension));
  }

  auto gradient(std::uint32_t slot) {
    return gradient_.template segment<kDimension>(static_cast<int>(slot) * kDimension);
  }

  std::vector<SlotPair> slots_;                   // Per edge.
  std::vector<std::vector<std::uint32_t>> rows_;  // Per block column, the block rows it has.
  std::vector<std::size_t> start_;                // Per block column, of its values.
  std::vector<std::uint8_t> has_edges_;           // Per slot.
  Eigen::SparseMatrix<double> hessian_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>> factor_;
};

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
          damping.value() < kMaxGraphDamping ? system_->solve(damping.value()) : 0.0;
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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "waymark/optimize/pose_graph.h"

namespace waymark {

inline constexpr std::uint32_t kNoPoseGraphSlot = UINT32_MAX;

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
    constexpr double kPriorInformation = 1e-9;
    const Eigen::VectorXd scale = hessian_.diagonal().array() + kPriorInformation;
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

}  // namespace waymark

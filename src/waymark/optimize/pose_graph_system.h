// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/thread_pool.h"
#include "waymark/optimize/pose_graph.h"
#include "waymark/solver/block_cholesky.h"
#include "waymark/solver/elimination_order.h"

namespace waymark {

inline constexpr std::uint32_t kNoPoseGraphSlot = UINT32_MAX;

/// The slots of the nodes of an edge; kNoPoseGraphSlot for one that is fixed.
struct SlotPair {
  std::uint32_t from;
  std::uint32_t to;
};

/// Normal equations of a pose graph: kDimension unknowns per slot, 6 where nodes keep their scale,
/// else 7. Nodes are put in an order of elimination, and their unknowns, one behind the other, cut
/// into the blocks of BlockCholesky, whatever their dimension. The order is found once.
template <int kDimension>
class PoseGraphSystem {
 public:
  using Block = Eigen::Matrix<double, kDimension, kDimension>;
  using Step = Eigen::Matrix<double, kDimension, 1>;

  PoseGraphSystem(std::uint32_t num_slots, std::span<const SlotPair> edges)
      : slots_(edges.begin(), edges.end()),
        has_edges_(num_slots, 0),
        diagonal_(num_slots, Block::Zero()),
        gradient_(Eigen::VectorXd::Zero(Eigen::Index{kDimension} * num_slots)) {
    for (const SlotPair& edge : slots_) {
      for (const std::uint32_t slot : {edge.from, edge.to}) {
        if (slot != kNoPoseGraphSlot) has_edges_[slot] = 1;
      }
      if (is_free(edge)) pairs_.push_back(std::minmax(edge.from, edge.to, std::greater<>()));
    }
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
    beside_.assign(pairs_.size(), Block::Zero());
    place_of_slot_ = order_of_elimination(num_slots, pairs_);
    if (num_slots > 0) factor_.emplace(num_blocks(), blocks_of_pairs());
  }

  bool has_edges(std::uint32_t slot) const { return has_edges_[slot] != 0; }

  void clear() {
    std::fill(diagonal_.begin(), diagonal_.end(), Block::Zero());
    std::fill(beside_.begin(), beside_.end(), Block::Zero());
    gradient_.setZero();
  }

  /// Adds an edge by its index in the span given to the constructor.
  void add(std::size_t edge, const PoseGraphResidual& residual, double weight) {
    const SlotPair& slots = slots_[edge];
    const Jacobian by_from = residual.by_from.template leftCols<kDimension>();
    const Jacobian by_to = residual.by_to.template leftCols<kDimension>();
    if (slots.from != kNoPoseGraphSlot) {
      diagonal_[slots.from].noalias() += weight * by_from.transpose() * by_from;
      gradient(slots.from).noalias() += weight * by_from.transpose() * residual.value;
    }
    if (slots.to != kNoPoseGraphSlot) {
      diagonal_[slots.to].noalias() += weight * by_to.transpose() * by_to;
      gradient(slots.to).noalias() += weight * by_to.transpose() * residual.value;
    }
    if (!is_free(slots)) return;
    const std::pair<std::uint32_t, std::uint32_t> pair =
        std::minmax(slots.from, slots.to, std::greater<>());
    Block& block = beside_[static_cast<std::size_t>(
        std::lower_bound(pairs_.begin(), pairs_.end(), pair) - pairs_.begin())];
    if (slots.from > slots.to) {
      block.noalias() += weight * by_from.transpose() * by_to;
    } else {
      block.noalias() += weight * by_to.transpose() * by_from;
    }
  }

  /// Finds the step of Levenberg-Marquardt and returns by how much it lowers the sum of squares of
  /// the linear problem; not a number if there is no step.
  double solve(double damping, ThreadPool& threads) {
    constexpr double kGraphPriorInformation = 1e-9;
    factor_->set_zero();
    Eigen::VectorXd scale(gradient_.size());
    for (std::uint32_t slot = 0; slot < diagonal_.size(); ++slot) {
      auto of_slot = scale.template segment<kDimension>(first_of(slot));
      of_slot = diagonal_[slot].diagonal().array() + kGraphPriorInformation;
      Block damped = diagonal_[slot];
      damped.diagonal() += damping * of_slot;
      put(slot, slot, damped);
    }
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      put(pairs_[i].first, pairs_[i].second, beside_[i]);
    for (std::size_t i = kDimension * diagonal_.size(); i < kBlockRows * num_blocks(); ++i) {
      const auto row = static_cast<Eigen::Index>(i % kBlockRows);
      factor_->diagonal(static_cast<std::uint32_t>(i / kBlockRows))(row, row) = 1.0;
    }
    if (!factor_->factorize(threads)) return std::numeric_limits<double>::quiet_NaN();
    Eigen::VectorXd solution =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kBlockRows * num_blocks()));
    for (std::uint32_t slot = 0; slot < diagonal_.size(); ++slot) {
      solution.template segment<kDimension>(unknown_of(slot)) = -gradient(slot);
    }
    factor_->solve_in_place(solution);
    step_.resize(gradient_.size());
    for (std::uint32_t slot = 0; slot < diagonal_.size(); ++slot) {
      step_.template segment<kDimension>(first_of(slot)) =
          solution.template segment<kDimension>(unknown_of(slot));
    }
    return step_.dot(damping * scale.cwiseProduct(step_) - gradient_);
  }

  Step step(std::uint32_t slot) const { return step_.template segment<kDimension>(first_of(slot)); }

 private:
  using Jacobian = Eigen::Matrix<double, 7, kDimension>;

  static bool is_free(const SlotPair& edge) {
    return edge.from != kNoPoseGraphSlot && edge.to != kNoPoseGraphSlot;
  }
  static Eigen::Index first_of(std::uint32_t slot) { return Eigen::Index{kDimension} * slot; }
  auto gradient(std::uint32_t slot) {
    return gradient_.template segment<kDimension>(first_of(slot));
  }

  std::size_t num_blocks() const {
    return (kDimension * diagonal_.size() + kBlockRows - 1) / kBlockRows;
  }
  /// The first of a slot's unknowns in the order of elimination.
  Eigen::Index unknown_of(std::uint32_t slot) const {
    return Eigen::Index{kDimension} * place_of_slot_[slot];
  }
  static std::uint32_t block_of(Eigen::Index unknown) {
    return static_cast<std::uint32_t>(unknown) / kBlockRows;
  }

  BlockPattern blocks_of_pairs() const {
    BlockPattern pattern;
    const auto add = [&](Eigen::Index row, Eigen::Index column) {
      for (std::uint32_t r = block_of(row); r <= block_of(row + kDimension - 1); ++r) {
        for (std::uint32_t c = block_of(column); c <= block_of(column + kDimension - 1); ++c) {
          if (r > c) pattern.push_back({r, c});
        }
      }
    };
    for (std::uint32_t slot = 0; slot < diagonal_.size(); ++slot) {
      add(unknown_of(slot), unknown_of(slot));
    }
    for (const auto& [a, b] : pairs_) {
      add(std::max(unknown_of(a), unknown_of(b)), std::min(unknown_of(a), unknown_of(b)));
    }
    return pattern;
  }

  /// Copies the block of two slots, or of one and itself, to where the factor has it.
  void put(std::uint32_t a, std::uint32_t b, const Block& block) {
    if (unknown_of(a) >= unknown_of(b)) {
      put_at(unknown_of(a), unknown_of(b), block);
    } else {
      put_at(unknown_of(b), unknown_of(a), block.transpose());
    }
  }

  void put_at(Eigen::Index row, Eigen::Index column, const Block& block) {
    constexpr Eigen::Index kRows = kBlockRows;
    for (Eigen::Index r = row; r < row + kDimension; r = (r / kRows + 1) * kRows) {
      const Eigen::Index num_rows = std::min((r / kRows + 1) * kRows, row + kDimension) - r;
      for (Eigen::Index c = column; c < column + kDimension; c = (c / kRows + 1) * kRows) {
        if (block_of(r) < block_of(c)) continue;
        const Eigen::Index num_columns = std::min((c / kRows + 1) * kRows, column + kDimension) - c;
        factor_->block(block_of(r), block_of(c))
            .block(r % kRows, c % kRows, num_rows, num_columns) =
            block.block(r - row, c - column, num_rows, num_columns);
      }
    }
  }

  std::vector<SlotPair> slots_;               // Per edge.
  std::vector<std::uint8_t> has_edges_;       // Per slot.
  BlockPattern pairs_;                        // Of slots with an edge, first > second, ascending.
  std::vector<Block> diagonal_;               // Per slot.
  std::vector<Block> beside_;                 // Per pair.
  std::vector<std::uint32_t> place_of_slot_;  // In the order of elimination.
  std::optional<BlockCholesky> factor_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
};

}  // namespace waymark

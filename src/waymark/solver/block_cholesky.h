// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hwy/aligned_allocator.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/base/thread_pool.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/factor_panels.h"
#include "waymark/solver/panel_kernel.h"

namespace waymark {

/// A symmetric positive definite matrix of 6 x 6 blocks, few of which are not zero, and its
/// Cholesky decomposition in place. Only the lower triangle is stored, in dense panels of columns
/// that share their rows, with room for what elimination fills in. Panels take what those before
/// them contribute, by dense products, and are then factorized (left-looking and supernodal: Ng &
/// Peyton 1993; Davis 2006, chapter 4; Chen et al. 2008). Each is one thread's work, which takes
/// its sources in ascending order: the same bits with any number of threads, and with any vectors.
class BlockCholesky {
 public:
  /// A block where it is kept.
  using Block = Eigen::Map<Matrix6d, 0, Eigen::OuterStride<kStripRows>>;

  BlockCholesky(std::size_t num_blocks, const BlockPattern& pattern);

  void set_zero();
  /// A block of the pattern or of the diagonal; row >= column.
  Block block(std::uint32_t row, std::uint32_t column);
  Block diagonal(std::uint32_t i) { return block(i, i); }
  /// Of the factor; zeros that are kept for the sake of dense panels do not count.
  std::size_t num_blocks() const { return plan_.num_blocks; }

  /// The panels, in which a caller may fill in the matrix, each by one thread.
  const FactorPanels& plan() const { return plan_; }
  /// Sets a column of a panel (counted from its first) as a whole. blocks: one for each row of the
  /// panel, those above the diagonal of any value, kPaddedBlockRows x 6 by columns.
  void set_column(std::size_t panel, std::size_t column, std::span<const double> blocks);

  /// Replaces the matrix by its factor; false if it is not positive definite.
  bool factorize(ThreadPool& threads);
  /// Solves matrix * x = b for the matrix that was factorized; b has 6 entries per block row.
  void solve_in_place(Eigen::VectorXd& b) const;
  /// The same for each column.
  void solve_in_place(Eigen::MatrixXd& b) const;

 private:
  using Panel = FactorPanels::Panel;

  std::size_t num_strips(const Panel& panel) const {
    return (panel.num_rows + kStripBlocks - 1) / kStripBlocks;
  }
  std::size_t strip_size(const Panel& panel) const {
    return kStripRows * kBlockRows * panel.width();
  }
  double* strip(std::size_t panel, std::size_t index) const {
    return values_.get() + first_value_[panel] + index * strip_size(plan_.panels[panel]);
  }
  /// By number of its row and column in the panel.
  double* block_in(std::size_t panel, std::size_t row, std::size_t column) const {
    return strip(panel, row / kStripBlocks) + column * kBlockRows * kStripRows +
           row % kStripBlocks * kBlockRows;
  }

  void find_places(std::size_t panel,
                   const FactorPanels::Source& source,
                   std::vector<std::uint32_t>& places) const;
  void subtract_source(std::size_t panel,
                       const FactorPanels::Source& source,
                       std::span<const std::uint32_t> places);
  bool factorize_panel(std::size_t panel);
  template <class Columns>
  void solve_forward(std::size_t panel, Columns& b) const;
  template <class Columns>
  void solve_backward(std::size_t panel, Columns& b) const;

  FactorPanels plan_;
  std::vector<std::size_t> first_value_;  ///< Per panel, and one past the end.
  hwy::AlignedFreeUniquePtr<double[]> values_;
};

}  // namespace waymark

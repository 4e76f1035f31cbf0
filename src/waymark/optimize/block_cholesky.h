// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Rows and columns of blocks that are not zero, row > column, in any order; repeats allowed.
using BlockPattern = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// An order of elimination that leaves few blocks to fill in, by approximate minimum degree
/// (Amestoy, Davis & Duff 1996): per block its new index.
std::vector<std::uint32_t> order_of_elimination(std::size_t num_blocks,
                                                const BlockPattern& pattern);

/// A symmetric positive definite matrix of 6 x 6 blocks, few of which are not zero, and its
/// Cholesky decomposition in place (Davis 2006, chapter 4, on blocks). Only the lower triangle is
/// stored, by columns, with room for what elimination fills in. Sums run in a fixed order.
class BlockCholesky {
 public:
  BlockCholesky(std::size_t num_blocks, const BlockPattern& pattern);

  void set_zero();
  /// Where a block of the pattern, or one of the diagonal, is kept.
  std::uint32_t index_of(std::uint32_t row, std::uint32_t column) const;
  Matrix6d& block(std::uint32_t index) { return blocks_[index]; }
  Matrix6d& diagonal(std::uint32_t i) { return blocks_[first_[i]]; }
  std::size_t num_blocks() const { return blocks_.size(); }

  /// Replaces the matrix by its factor; false if it is not positive definite.
  bool factorize();
  /// Solves matrix * x = b for the matrix that was factorized; b has 6 entries per block row.
  void solve_in_place(Eigen::VectorXd& b) const;

 private:
  void fill_in(const BlockPattern& pattern);
  void subtract_products(std::uint32_t column);

  std::vector<std::uint32_t> first_;  ///< Per column its diagonal block; one past the end.
  std::vector<std::uint32_t> row_;    ///< Per block, ascending within a column.
  std::vector<Matrix6d> blocks_;
};

}  // namespace waymark

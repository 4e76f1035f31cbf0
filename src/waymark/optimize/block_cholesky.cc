// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/block_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "waymark/base/check.h"

namespace waymark {

std::vector<std::uint32_t> order_of_elimination(std::size_t num_blocks,
                                                const BlockPattern& pattern) {
  std::vector<Eigen::Triplet<double>> entries;  // With the diagonal, or rows count as dense.
  for (int i = 0; i < static_cast<int>(num_blocks); ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [row, column] : pattern) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), 1.0);
    entries.emplace_back(static_cast<int>(column), static_cast<int>(row), 1.0);
  }
  const auto size = static_cast<Eigen::Index>(num_blocks);
  Eigen::SparseMatrix<double> graph(size, size);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType block_of_position;
  Eigen::AMDOrdering<int>()(graph, block_of_position);
  std::vector<std::uint32_t> position(num_blocks);
  for (std::size_t i = 0; i < num_blocks; ++i) {
    const auto block = block_of_position.indices()[static_cast<Eigen::Index>(i)];
    position[static_cast<std::size_t>(block)] = static_cast<std::uint32_t>(i);
  }
  return position;
}

BlockCholesky::BlockCholesky(std::size_t num_blocks, const BlockPattern& pattern) {
  first_.resize(num_blocks + 1);
  fill_in(pattern);
  blocks_.resize(row_.size());
}

/// The rows of a column of the factor: those of the matrix, and those of every earlier column
/// whose first row below the diagonal is this one.
void BlockCholesky::fill_in(const BlockPattern& pattern) {
  const std::size_t num_columns = first_.size() - 1;
  std::vector<std::vector<std::uint32_t>> rows(num_columns);
  for (const auto& [row, column] : pattern) {
    WAYMARK_CHECK(row > column && row < num_columns);
    rows[column].push_back(row);
  }
  for (std::size_t column = 0; column < num_columns; ++column) {
    auto& below = rows[column];
    std::sort(below.begin(), below.end());
    below.erase(std::unique(below.begin(), below.end()), below.end());
    first_[column] = static_cast<std::uint32_t>(row_.size());
    row_.push_back(static_cast<std::uint32_t>(column));
    row_.insert(row_.end(), below.begin(), below.end());
    if (below.empty()) continue;
    auto& parent = rows[below.front()];
    parent.insert(parent.end(), below.begin() + 1, below.end());
  }
  first_[num_columns] = static_cast<std::uint32_t>(row_.size());
}

void BlockCholesky::set_zero() {
  for (Matrix6d& block : blocks_) block.setZero();
}

std::uint32_t BlockCholesky::index_of(std::uint32_t row, std::uint32_t column) const {
  const auto begin = row_.begin() + first_[column];
  const auto end = row_.begin() + first_[column + 1];
  const auto at = std::lower_bound(begin, end, row);
  WAYMARK_CHECK(at != end && *at == row);
  return static_cast<std::uint32_t>(at - row_.begin());
}

bool BlockCholesky::factorize() {
  for (std::uint32_t column = 0; column + 1 < first_.size(); ++column) {
    Matrix6d& diagonal = blocks_[first_[column]];
    const Eigen::LLT<Matrix6d> factor(diagonal);
    if (factor.info() != Eigen::Success) return false;
    diagonal = factor.matrixL();
    for (std::uint32_t i = first_[column] + 1; i < first_[column + 1]; ++i) {
      diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
          blocks_[i]);
    }
    subtract_products(column);
  }
  return true;
}

/// Takes what a finished column contributes from the columns after it. The rows below one of its
/// rows are among those of the column of that number, in the same order.
void BlockCholesky::subtract_products(std::uint32_t column) {
  const std::uint32_t end = first_[column + 1];
  for (std::uint32_t k = first_[column] + 1; k < end; ++k) {
    std::uint32_t target = first_[row_[k]];
    for (std::uint32_t i = k; i < end; ++i) {
      while (row_[target] != row_[i]) ++target;
      blocks_[target].noalias() -= blocks_[i] * blocks_[k].transpose();
    }
  }
}

void BlockCholesky::solve_in_place(Eigen::VectorXd& b) const {
  const auto part = [&b](std::uint32_t row) {
    return b.segment<6>(static_cast<Eigen::Index>(6 * row));
  };
  const auto num_columns = static_cast<std::uint32_t>(first_.size() - 1);
  for (std::uint32_t column = 0; column < num_columns; ++column) {
    const std::uint32_t first = first_[column];
    auto x = part(column);
    blocks_[first].triangularView<Eigen::Lower>().solveInPlace(x);
    for (std::uint32_t i = first + 1; i < first_[column + 1]; ++i) {
      part(row_[i]).noalias() -= blocks_[i] * x;
    }
  }
  for (std::uint32_t column = num_columns; column-- > 0;) {
    const std::uint32_t first = first_[column];
    auto x = part(column);
    for (std::uint32_t i = first + 1; i < first_[column + 1]; ++i) {
      x.noalias() -= blocks_[i].transpose() * part(row_[i]);
    }
    blocks_[first].triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  }
}

}  // namespace waymark

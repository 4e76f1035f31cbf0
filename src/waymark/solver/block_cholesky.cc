// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/block_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <new>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using ConstBlock = Eigen::Map<const Matrix6d, 0, Eigen::OuterStride<kStripRows>>;
using ConstStrip = Eigen::Map<const Eigen::Matrix<double, kStripRows, Eigen::Dynamic>>;

/// What tells others that a panel is finished.
class Finished {
 public:
  explicit Finished(std::size_t num_panels) : flags_(num_panels) {}

  void wait_for(std::size_t panel) const { flags_[panel].wait(0, std::memory_order_acquire); }
  void set(std::size_t panel) {
    flags_[panel].store(1, std::memory_order_release);
    flags_[panel].notify_all();
  }

 private:
  std::vector<std::atomic<std::uint32_t>> flags_;
};

auto rows_of_block(std::uint32_t block) { return static_cast<Eigen::Index>(6 * block); }

}  // namespace

BlockCholesky::BlockCholesky(std::size_t num_blocks, const BlockPattern& pattern)
    : plan_(plan_panels(num_blocks, pattern)) {
  first_value_.push_back(0);
  for (const Panel& panel : plan_.panels) {
    first_value_.push_back(first_value_.back() + num_strips(panel) * strip_size(panel));
  }
  values_ = hwy::AllocateAligned<double>(std::max<std::size_t>(first_value_.back(), 1));
  if (!values_) throw std::bad_alloc();
  set_zero();
}

void BlockCholesky::set_zero() { std::fill_n(values_.get(), first_value_.back(), 0.0); }

BlockCholesky::Block BlockCholesky::block(std::uint32_t row, std::uint32_t column) {
  const std::uint32_t index = plan_.panel_of_column[column];
  const auto rows = plan_.rows_of(plan_.panels[index]);
  const auto at = std::lower_bound(rows.begin(), rows.end(), row);
  WAYMARK_CHECK(row >= column && at != rows.end() && *at == row);
  return Block(block_in(
      index, static_cast<std::size_t>(at - rows.begin()), column - plan_.panels[index].begin));
}

void BlockCholesky::set_column(std::size_t panel,
                               std::size_t column,
                               std::span<const double> blocks) {
  constexpr std::size_t kSize = kBlockRows * kPaddedBlockRows;
  WAYMARK_CHECK(blocks.size() == kSize * plan_.panels[panel].num_rows);
  for (std::size_t row = column; row < plan_.panels[panel].num_rows; ++row) {
    double* const to = block_in(panel, row, column);
    for (std::size_t i = 0; i < kBlockRows; ++i) {
      std::copy_n(
          blocks.data() + row * kSize + i * kPaddedBlockRows, kBlockRows, to + i * kStripRows);
    }
  }
}

bool BlockCholesky::factorize(ThreadPool& threads) {
  // What waits for a panel has been begun after it: nobody waits for what nobody works on.
  Finished finished(plan_.panels.size());
  std::atomic<bool> is_positive = true;
  threads.for_chunks(plan_.schedule.size(), 1, [&](std::size_t begin, std::size_t) {
    const std::uint32_t index = plan_.schedule[begin];
    std::vector<std::uint32_t> places;
    for (const FactorPanels::Source& source : plan_.sources_of(index)) {
      find_places(index, source, places);
      finished.wait_for(source.panel);
      if (is_positive) subtract_source(index, source, places);
    }
    if (is_positive && !factorize_panel(index)) is_positive = false;
    finished.set(index);
  });
  return is_positive;
}

/// Where in a panel the rows of a source are, from the first that it acts with.
void BlockCholesky::find_places(std::size_t panel,
                                const FactorPanels::Source& source,
                                std::vector<std::uint32_t>& places) const {
  const auto rows = plan_.rows_of(plan_.panels[panel]);
  const auto rows_of_source = plan_.rows_of(plan_.panels[source.panel]);
  places.resize(rows_of_source.size());
  std::uint32_t at = 0;
  for (std::size_t i = source.first; i < rows_of_source.size(); ++i) {
    while (rows[at] != rows_of_source[i]) ++at;
    places[i] = at;
  }
}

void BlockCholesky::subtract_source(std::size_t panel,
                                    const FactorPanels::Source& source,
                                    std::span<const std::uint32_t> places) {
  const Panel& from = plan_.panels[source.panel];
  const auto rows = plan_.rows_of(from);
  const std::size_t num_columns = kBlockRows * from.width();
  alignas(64) double product[kStripRows * kBlockRows];
  for (std::size_t s = source.first / kStripBlocks; s < num_strips(from); ++s) {
    const double* const strip_of_source = strip(source.panel, s);
    const std::size_t end = std::min((s + 1) * kStripBlocks, rows.size());
    for (std::size_t column = source.first; column < std::min<std::size_t>(source.last, end);
         ++column) {
      std::fill(std::begin(product), std::end(product), 0.0);
      subtract_strip_product(
          strip_of_source, block_in(source.panel, column, 0), num_columns, product);
      for (std::size_t row = std::max(s * kStripBlocks, column); row < end; ++row) {
        double* const to = block_in(panel, places[row], places[column]);
        Block(to) += ConstBlock(product + row % kStripBlocks * kBlockRows);
      }
    }
  }
}

bool BlockCholesky::factorize_panel(std::size_t panel) {
  const std::size_t width = plan_.panels[panel].width();
  const std::size_t end = num_strips(plan_.panels[panel]);
  for (std::size_t column = 0; column < width; ++column) {
    const std::size_t num_before = kBlockRows * column;
    const std::size_t first = column / kStripBlocks;
    Block diagonal(block_in(panel, column, column));
    for (std::size_t s = first; s < end; ++s) {
      subtract_strip_product(strip(panel, s),
                             block_in(panel, column, 0),
                             num_before,
                             strip(panel, s) + num_before * kStripRows);
    }
    const Eigen::LLT<Matrix6d> factor(diagonal);
    if (factor.info() != Eigen::Success) return false;
    const Matrix6d lower = factor.matrixL();
    for (std::size_t s = first; s < end; ++s) {
      solve_strip(lower.data(), strip(panel, s) + num_before * kStripRows);
    }
    // What is above the diagonal in its strip is not of the factor.
    for (std::size_t row = first * kStripBlocks; row < column; ++row) {
      Block(block_in(panel, row, column)).setZero();
    }
    diagonal = lower;
  }
  return true;
}

template <class Columns>
void BlockCholesky::solve_forward(std::size_t index, Columns& b) const {
  const Panel& panel = plan_.panels[index];
  const auto rows = plan_.rows_of(panel);
  const std::uint32_t width = panel.width();
  auto x = b.middleRows(rows_of_block(panel.begin), rows_of_block(width));
  for (std::uint32_t column = 0; column < width; ++column) {
    auto part = x.template middleRows<6>(rows_of_block(column));
    ConstBlock(block_in(index, column, column))
        .template triangularView<Eigen::Lower>()
        .solveInPlace(part);
    for (std::uint32_t row = column + 1; row < width; ++row) {
      x.template middleRows<6>(rows_of_block(row)).noalias() -=
          ConstBlock(block_in(index, row, column)) * part;
    }
  }
  Eigen::Matrix<double, kStripRows, Columns::ColsAtCompileTime> product(kStripRows, b.cols());
  for (std::size_t s = width / kStripBlocks; s < num_strips(panel); ++s) {
    product.noalias() = ConstStrip(strip(index, s), kStripRows, x.rows()) * x;
    const std::size_t end = std::min((s + 1) * kStripBlocks, rows.size());
    for (std::size_t row = std::max<std::size_t>(s * kStripBlocks, width); row < end; ++row) {
      b.template middleRows<6>(rows_of_block(rows[row])) -=
          product.template middleRows<6>(rows_of_block(row % kStripBlocks));
    }
  }
}

template <class Columns>
void BlockCholesky::solve_backward(std::size_t index, Columns& b) const {
  const Panel& panel = plan_.panels[index];
  const auto rows = plan_.rows_of(panel);
  const std::uint32_t width = panel.width();
  auto x = b.middleRows(rows_of_block(panel.begin), rows_of_block(width));
  Eigen::Matrix<double, kStripRows, Columns::ColsAtCompileTime> below(kStripRows, b.cols());
  for (std::size_t s = width / kStripBlocks; s < num_strips(panel); ++s) {
    below.setZero();
    const std::size_t end = std::min((s + 1) * kStripBlocks, rows.size());
    for (std::size_t row = std::max<std::size_t>(s * kStripBlocks, width); row < end; ++row) {
      below.template middleRows<6>(rows_of_block(row % kStripBlocks)) =
          b.template middleRows<6>(rows_of_block(rows[row]));
    }
    x.noalias() -= ConstStrip(strip(index, s), kStripRows, x.rows()).transpose() * below;
  }
  for (std::uint32_t column = width; column-- > 0;) {
    auto part = x.template middleRows<6>(rows_of_block(column));
    for (std::uint32_t row = column + 1; row < width; ++row) {
      part.noalias() -= ConstBlock(block_in(index, row, column)).transpose() *
                        x.template middleRows<6>(rows_of_block(row));
    }
    ConstBlock(block_in(index, column, column))
        .transpose()
        .template triangularView<Eigen::Upper>()
        .solveInPlace(part);
  }
}

void BlockCholesky::solve_in_place(Eigen::VectorXd& b) const {
  for (std::size_t panel = 0; panel < plan_.panels.size(); ++panel) solve_forward(panel, b);
  for (std::size_t panel = plan_.panels.size(); panel-- > 0;) solve_backward(panel, b);
}

void BlockCholesky::solve_in_place(Eigen::MatrixXd& b) const {
  for (std::size_t panel = 0; panel < plan_.panels.size(); ++panel) solve_forward(panel, b);
  for (std::size_t panel = plan_.panels.size(); panel-- > 0;) solve_backward(panel, b);
}

}  // namespace waymark

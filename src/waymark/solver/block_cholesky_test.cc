// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <set>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

/// Neighbours see each other, and a few pairs far away.
BlockPattern chain_with_loops(std::uint32_t num_blocks, std::uint32_t num_loops, Rng& rng) {
  BlockPattern pattern;
  for (std::uint32_t i = 1; i < num_blocks; ++i) pattern.push_back({i, i - 1});
  for (std::uint32_t i = 0; i < num_loops; ++i) {
    const std::uint32_t row = 1 + rng.below(num_blocks - 1);
    pattern.push_back({row, rng.below(row)});
  }
  return pattern;
}

struct System {
  BlockCholesky sparse;
  Eigen::MatrixXd dense;
};

/// Random blocks where the pattern allows, positive definite by a heavy diagonal.
System random_system(std::uint32_t num_blocks, const BlockPattern& pattern, Rng& rng) {
  const auto size = static_cast<Eigen::Index>(6 * num_blocks);
  System system{BlockCholesky(num_blocks, pattern), Eigen::MatrixXd::Zero(size, size)};
  system.sparse.set_zero();
  const std::set<std::pair<std::uint32_t, std::uint32_t>> distinct(pattern.begin(), pattern.end());
  for (const auto& [row, column] : distinct) {
    Matrix6d block = Matrix6d::NullaryExpr([&] { return rng.uniform(-1.0, 1.0); });
    system.sparse.block(row, column) = block;
    system.dense.block<6, 6>(6 * row, 6 * column) = block;
    system.dense.block<6, 6>(6 * column, 6 * row) = block.transpose();
  }
  for (std::uint32_t i = 0; i < num_blocks; ++i) {
    const Matrix6d block = 60.0 * Matrix6d::Identity();
    system.sparse.diagonal(i) = block;
    system.dense.block<6, 6>(6 * i, 6 * i) = block;
  }
  return system;
}

TEST(BlockCholesky, SolvesAsADenseDecompositionDoes) {
  ThreadPool one_thread(1);
  Rng rng(1, 2);
  for (const std::uint32_t num_loops : {0u, 10u, 60u}) {
    System system = random_system(30, chain_with_loops(30, num_loops, rng), rng);
    const Eigen::VectorXd b =
        Eigen::VectorXd::NullaryExpr(180, [&] { return rng.uniform(-1.0, 1.0); });
    ASSERT_TRUE(system.sparse.factorize(one_thread));
    Eigen::VectorXd x = b;
    system.sparse.solve_in_place(x);
    EXPECT_LT((x - system.dense.llt().solve(b)).norm(), 1e-12);
  }
}

TEST(BlockCholesky, SaysWhatIsNotPositiveDefinite) {
  ThreadPool one_thread(1);
  Rng rng(1, 3);
  System system = random_system(10, chain_with_loops(10, 3, rng), rng);
  system.sparse.diagonal(7)(2, 2) = -1.0;
  EXPECT_FALSE(system.sparse.factorize(one_thread));
}

TEST(BlockCholesky, HasTheSameBitsWithAnyNumberOfThreads) {
  constexpr std::uint32_t kNumBlocks = 700;
  Rng rng(1, 5);
  BlockPattern grid;  // 35 columns of 20, with the neighbours of neighbours: many panels.
  for (std::uint32_t i = 0; i < kNumBlocks; ++i) {
    for (const std::uint32_t step : {1u, 2u, 20u, 21u, 40u}) {
      if (i >= step) grid.push_back({i, i - step});
    }
  }
  const std::vector<std::uint32_t> position = order_of_elimination(kNumBlocks, grid);
  BlockPattern ordered;
  for (const auto& [row, column] : grid) {
    ordered.push_back(std::minmax(position[row], position[column], std::greater<>()));
  }
  std::vector<Eigen::VectorXd> solutions;
  for (const unsigned num_threads : {1u, 2u, 4u}) {
    ThreadPool threads(num_threads);
    Rng values(1, 6);
    System system = random_system(kNumBlocks, ordered, values);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * kNumBlocks, -1.0, 1.0);
    ASSERT_GT(system.sparse.plan().panels.size(), 20u);
    ASSERT_TRUE(system.sparse.factorize(threads));
    solutions.push_back(b);
    system.sparse.solve_in_place(solutions.back());
    if (num_threads == 1) {
      EXPECT_LT((solutions[0] - system.dense.llt().solve(b)).norm(), 1e-11);
      Eigen::MatrixXd twice(b.size(), 2);
      twice << b, 2.0 * b;
      system.sparse.solve_in_place(twice);
      EXPECT_LT((twice.col(1) - 2.0 * solutions[0]).norm(), 1e-11);
    }
  }
  EXPECT_EQ(solutions[0], solutions[1]);
  EXPECT_EQ(solutions[0], solutions[2]);
}

TEST(BlockCholesky, DividesAGraphInNestedParts) {
  constexpr std::uint32_t kSide = 40;
  BlockPattern grid;
  for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
    if (i % kSide > 0) grid.push_back({i, i - 1});
    if (i >= kSide) grid.push_back({i, i - kSide});
  }
  const std::vector<std::uint32_t> position = order_of_elimination(kSide * kSide, grid);
  EXPECT_EQ(std::set<std::uint32_t>(position.begin(), position.end()).size(), kSide * kSide);
  BlockPattern ordered;
  for (const auto& [row, column] : grid) {
    ordered.push_back(std::minmax(position[row], position[column], std::greater<>()));
  }
  // Row by row each column has kSide blocks below.
  EXPECT_LT(plan_panels(kSide * kSide, ordered).num_blocks, kSide * kSide * kSide / 2);
}

TEST(BlockCholesky, FillsLittleInWhereTheOrderIsGood) {
  Rng rng(1, 4);
  constexpr std::uint32_t kNumBlocks = 300;
  const BlockPattern pattern = chain_with_loops(kNumBlocks, 5, rng);
  const std::vector<std::uint32_t> position = order_of_elimination(kNumBlocks, pattern);
  EXPECT_EQ(std::set<std::uint32_t>(position.begin(), position.end()).size(), kNumBlocks);
  BlockPattern ordered;
  for (const auto& [row, column] : pattern) {
    ordered.push_back(std::minmax(position[row], position[column], std::greater<>()));
  }
  const std::size_t num_entries = kNumBlocks + pattern.size();
  // Around a loop, every block but the last ones fills one in.
  EXPECT_LT(BlockCholesky(kNumBlocks, ordered).num_blocks(), num_entries + kNumBlocks);
  EXPECT_GT(BlockCholesky(kNumBlocks, pattern).num_blocks(), num_entries + 3 * kNumBlocks / 2);
}

TEST(BlockCholesky, DoesWithoutAnyBlock) {
  ThreadPool one_thread(1);
  BlockCholesky empty(0, {});
  Eigen::VectorXd none(0);
  EXPECT_TRUE(empty.factorize(one_thread));
  empty.solve_in_place(none);
}

}  // namespace
}  // namespace waymark

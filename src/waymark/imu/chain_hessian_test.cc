// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/chain_hessian.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

template <class Matrix>
Matrix random_matrix(Rng& rng) {
  Matrix matrix;
  for (double& value : matrix.reshaped()) value = rng.normal();
  return matrix;
}

TEST(ChainHessian, IsSolvedAsADenseOne) {
  constexpr std::size_t kNumStates = 6;
  Rng rng(3, 0);
  ChainHessian chain(kNumStates);
  const Eigen::Index size = chain.diagonal().size();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Identity(size, size);
  chain.diagonal().setOnes();
  for (std::size_t i = 0; i + 1 < kNumStates; ++i) {
    const auto by_states = random_matrix<Eigen::Matrix<double, 15, 30>>(rng);
    const auto by_setup = random_matrix<Matrix15x10d>(rng);
    chain.add(i, by_states, by_setup);
    Eigen::MatrixXd by_all = Eigen::MatrixXd::Zero(15, size);
    by_all.leftCols<10>() = by_setup;
    by_all.middleCols<30>(10 + 15 * static_cast<Eigen::Index>(i)) = by_states;
    dense += by_all.transpose() * by_all;
  }
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(size, -1.0, 2.0);
  EXPECT_TRUE(chain.solve(right).isApprox(dense.lu().solve(right), 1e-9));

  const Eigen::MatrixXd inverse = dense.inverse();
  const std::vector<Matrix25d> covariances = chain.covariances();
  ASSERT_EQ(covariances.size(), kNumStates);
  for (std::size_t i = 0; i < kNumStates; ++i) {
    const auto at = 10 + 15 * static_cast<Eigen::Index>(i);
    Matrix25d covariance;
    covariance << inverse.topLeftCorner(10, 10), inverse.block(0, at, 10, 15),
        inverse.block(at, 0, 15, 10), inverse.block(at, at, 15, 15);
    EXPECT_TRUE(covariances[i].isApprox(covariance, 1e-9));
  }
}

}  // namespace
}  // namespace waymark

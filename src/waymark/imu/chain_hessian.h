// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inside of the start (inertial_start.h).

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/inertial_start.h"

namespace waymark {

/// Second derivatives by the setup (10 rows) and by a chain of states (15 rows each, at least one),
/// of which only neighbours have terms in common: what is kept and the work of a solution grow with
/// the length of the chain.
class ChainHessian {
 public:
  explicit ChainHessian(std::size_t num_states);

  /// Of all rows; what is added to it counts.
  Eigen::VectorXd& diagonal() { return diagonal_; }
  const Eigen::VectorXd& diagonal() const { return diagonal_; }

  /// Adds J^T J of a residual. by_states: its derivatives by a state and the one after it.
  void add(std::size_t first,
           const Eigen::Matrix<double, 15, 30>& by_states,
           const Matrix15x10d& by_setup);

  /// As minimize_over_pose wants it.
  const ChainHessian& ldlt() const { return *this; }
  /// NaN where it is not positive definite.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  /// Of the setup and each state: blocks of its inverse (Rauch, Tung and Striebel 1965). NaN where
  /// it is not positive definite.
  std::vector<Matrix25d> covariances() const;

 private:
  using ByRest = Eigen::Matrix<double, 15, 25>;  ///< By the setup and the next state.
  struct Elimination {
    std::vector<Eigen::LLT<Matrix15d>> states;
    std::vector<ByRest> by_rest;
    Matrix25d last;
  };
  Elimination eliminate() const;
  Matrix15d of_state(std::size_t i) const;

  Eigen::VectorXd diagonal_;
  Eigen::Matrix<double, 10, 10> setup_ = Eigen::Matrix<double, 10, 10>::Zero();
  std::vector<Matrix15d> states_;
  std::vector<Matrix15d> by_next_;
  std::vector<Matrix15x10d> by_setup_;
};

}  // namespace waymark

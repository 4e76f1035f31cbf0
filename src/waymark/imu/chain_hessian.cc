// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/chain_hessian.h"

#include <limits>

namespace waymark {
namespace {

using Vector25d = Eigen::Matrix<double, 25, 1>;

Eigen::Index row_of(std::size_t state) { return 10 + 15 * static_cast<Eigen::Index>(state); }

}  // namespace

ChainHessian::ChainHessian(std::size_t num_states)
    : diagonal_(Eigen::VectorXd::Zero(row_of(num_states))),
      states_(num_states, Matrix15d::Zero()),
      by_next_(num_states - 1, Matrix15d::Zero()),
      by_setup_(num_states, Matrix15x10d::Zero()) {}

void ChainHessian::add(std::size_t first,
                       const Eigen::Matrix<double, 15, 30>& by_states,
                       const Matrix15x10d& by_setup) {
  const auto by_first = by_states.leftCols<15>(), by_second = by_states.rightCols<15>();
  setup_ += by_setup.transpose() * by_setup;
  states_[first] += by_first.transpose() * by_first;
  states_[first + 1] += by_second.transpose() * by_second;
  by_next_[first] += by_first.transpose() * by_second;
  by_setup_[first] += by_first.transpose() * by_setup;
  by_setup_[first + 1] += by_second.transpose() * by_setup;
  diagonal_.head<10>() += by_setup.colwise().squaredNorm().transpose();
  diagonal_.segment<30>(row_of(first)) += by_states.colwise().squaredNorm().transpose();
}

Matrix15d ChainHessian::of_state(std::size_t i) const {
  Matrix15d own = states_[i];
  own.diagonal() = diagonal_.segment<15>(row_of(i));
  return own;
}

/// From the first state on.
ChainHessian::Elimination ChainHessian::eliminate() const {
  Elimination done;
  Eigen::Matrix<double, 10, 10> setup = setup_;
  setup.diagonal() = diagonal_.head<10>();
  Matrix15d own = of_state(0);
  Matrix15x10d by_setup = by_setup_[0];
  for (std::size_t i = 0; i + 1 < states_.size(); ++i) {
    done.states.emplace_back(own);
    ByRest& by_rest = done.by_rest.emplace_back();
    by_rest << by_setup, by_next_[i];
    const ByRest solved = done.states.back().solve(by_rest);
    const Matrix25d taken = by_rest.transpose() * solved;
    setup -= taken.topLeftCorner<10, 10>();
    by_setup = by_setup_[i + 1] - taken.bottomLeftCorner<15, 10>();
    own = of_state(i + 1) - taken.bottomRightCorner<15, 15>();
  }
  done.last << setup, by_setup.transpose(), by_setup, own;
  return done;
}

Eigen::VectorXd ChainHessian::solve(const Eigen::VectorXd& right) const {
  const Elimination done = eliminate();
  Eigen::VectorXd left = right;
  const auto last = row_of(states_.size() - 1);
  for (std::size_t i = 0; i < done.states.size(); ++i) {
    const Vector15d own = left.segment<15>(row_of(i));
    const Vector25d taken = done.by_rest[i].transpose() * done.states[i].solve(own);
    left.head<10>() -= taken.head<10>();
    left.segment<15>(row_of(i + 1)) -= taken.tail<15>();
  }
  Vector25d rest;
  rest << left.head<10>(), left.segment<15>(last);
  rest = done.last.llt().solve(rest);
  left.head<10>() = rest.head<10>();
  left.segment<15>(last) = rest.tail<15>();
  for (std::size_t i = done.states.size(); i-- > 0;) {
    rest.tail<15>() = left.segment<15>(row_of(i + 1));
    const Vector15d own = left.segment<15>(row_of(i)) - done.by_rest[i] * rest;
    left.segment<15>(row_of(i)) = done.states[i].solve(own);
  }
  return left;
}

std::vector<Matrix25d> ChainHessian::covariances() const {
  const Elimination done = eliminate();
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<Matrix25d> all(states_.size(), Matrix25d::Constant(kNothing));
  const Eigen::LLT<Matrix25d> last(done.last);
  if (last.info() != Eigen::Success) return all;
  all.back() = last.solve(Matrix25d::Identity());
  for (std::size_t i = done.states.size(); i-- > 0;) {
    const ByRest gain = done.states[i].solve(done.by_rest[i]);
    const ByRest with_rest = -gain * all[i + 1];
    const Matrix15d own =
        done.states[i].solve(Matrix15d::Identity()) - with_rest * gain.transpose();
    all[i] << all[i + 1].topLeftCorner<10, 10>(), with_rest.leftCols<10>().transpose(),
        with_rest.leftCols<10>(), own;
  }
  return all;
}

}  // namespace waymark

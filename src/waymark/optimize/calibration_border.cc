// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/calibration_border.h"

#include <Eigen/Cholesky>

namespace waymark {
namespace {

/// The way is divided into so many parts: enough to compare them, and long enough each for errors
/// that last to stay within one.
constexpr Eigen::Index kNumParts = 10;

}  // namespace

CalibrationBorder::CalibrationBorder(std::size_t num_parameters,
                                     std::size_t num_slots,
                                     std::size_t num_points) {
  const auto count = static_cast<Eigen::Index>(num_parameters);
  information_.resize(count, count);
  gradient_.resize(count);
  poses_.resize(static_cast<Eigen::Index>(6 * num_slots), count);
  points_.resize(3, count * static_cast<Eigen::Index>(num_points));
  scores_.setZero(count, kNumParts);
}

void CalibrationBorder::begin(const BundleCalibration& calibration, const Eigen::VectorXd& change) {
  information_ = calibration.prior_information;
  gradient_ = calibration.prior_information * (change - calibration.prior_change);
  poses_.setZero();
  points_.setZero();
}

void CalibrationBorder::begin_elimination(double damping) {
  reduced_information_ = information_;
  reduced_information_.diagonal() += damping * information_.diagonal();
  reduced_gradient_ = gradient_;
  reduced_poses_ = poses_;
}

void CalibrationBorder::eliminate_point(std::size_t point,
                                        const Eigen::Matrix3d& half,
                                        const Eigen::Vector3d& gradient) {
  auto eliminated = points_.middleCols(column(point), gradient_.size());
  for (Eigen::Index i = 0; i < eliminated.cols(); ++i) {
    eliminated.col(i) = half * eliminated.col(i).eval();
  }
  reduced_information_ -= eliminated.transpose().lazyProduct(eliminated);
  reduced_gradient_ -= eliminated.transpose().lazyProduct(gradient);
}

void CalibrationBorder::eliminate_link(std::size_t slot,
                                       std::size_t point,
                                       const Eigen::Matrix<double, 6, 3>& eliminated) {
  reduced_poses_.middleRows<6>(static_cast<Eigen::Index>(6 * slot)) -=
      eliminated.lazyProduct(points_.middleCols(column(point), gradient_.size()));
}

bool CalibrationBorder::solve(const BlockCholesky& poses, Eigen::VectorXd& gradient) {
  solved_ = reduced_poses_;
  poses.solve_in_place(solved_);
  poses.solve_in_place(gradient);
  reduced_information_.noalias() -= reduced_poses_.transpose() * solved_;
  reduced_gradient_.noalias() -= reduced_poses_.transpose() * gradient;
  const Eigen::LLT<Eigen::MatrixXd> factor(reduced_information_);
  if (factor.info() != Eigen::Success) return false;
  solution_ = factor.solve(reduced_gradient_);
  gradient.noalias() -= solved_ * solution_;
  return true;
}

Eigen::Vector3d CalibrationBorder::share_of_point(std::size_t point) const {
  return points_.middleCols(column(point), gradient_.size()) * solution_;
}

void CalibrationBorder::add_score(std::size_t pose,
                                  std::size_t num_poses,
                                  const Eigen::VectorXd& score) {
  const auto part = static_cast<Eigen::Index>(pose * kNumParts / num_poses);
  scores_.col(part) += score;
}

CalibrationEvidence CalibrationBorder::evidence() const {
  const Eigen::MatrixXd off = scores_.colwise() - scores_.rowwise().mean();
  return {reduced_information_, off * off.transpose() * (kNumParts / (kNumParts - 1.0))};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/calibration_border.h"

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
  poses_.resize(count, static_cast<Eigen::Index>(6 * num_slots));
  points_.resize(count, static_cast<Eigen::Index>(3 * num_points));
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
  auto eliminated = points_.middleCols<3>(3 * static_cast<Eigen::Index>(point));
  eliminated = eliminated.lazyProduct(half.transpose()).eval();
  reduced_information_ -= eliminated.lazyProduct(eliminated.transpose());
  reduced_gradient_ -= eliminated.lazyProduct(gradient);
}

void CalibrationBorder::eliminate_link(std::size_t slot,
                                       std::size_t point,
                                       const Eigen::Matrix<double, 6, 3>& eliminated) {
  reduced_poses_.middleCols<6>(static_cast<Eigen::Index>(6 * slot)) -=
      of_point(point).lazyProduct(eliminated.transpose());
}

bool CalibrationBorder::solve(const BlockCholesky& poses, Eigen::VectorXd& gradient) {
  Eigen::MatrixXd solved = reduced_poses_.transpose();
  poses.solve_in_place(solved);
  poses.solve_in_place(gradient);
  reduced_information_.noalias() -= reduced_poses_ * solved;
  reduced_gradient_.noalias() -= reduced_poses_ * gradient;
  const Eigen::LLT<Eigen::MatrixXd> factor(reduced_information_);
  if (factor.info() != Eigen::Success) return false;
  solution_ = factor.solve(reduced_gradient_);
  gradient.noalias() -= solved * solution_;
  solved_ = solved.transpose();
  return true;
}

Eigen::Vector3d CalibrationBorder::share_of_point(std::size_t point) const {
  return of_point(point).transpose() * solution_;
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

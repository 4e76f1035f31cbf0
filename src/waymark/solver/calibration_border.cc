// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/calibration_border.h"

#include <Eigen/Cholesky>

namespace waymark {

void CalibrationColumns::flush(Eigen::Ref<Eigen::MatrixXd> information,
                               Eigen::Ref<Eigen::VectorXd> gradient) {
  const auto columns = columns_.leftCols(used_);
  information.selfadjointView<Eigen::Lower>().rankUpdate(columns);
  gradient.noalias() += columns * residuals_.head(used_);
  clear();
}

CalibrationBorder::CalibrationBorder(std::size_t num_parameters,
                                     std::size_t num_slots,
                                     std::size_t num_points) {
  const auto count = static_cast<Eigen::Index>(num_parameters);
  information_.resize(count, count);
  gradient_.resize(count);
  poses_.resize(count, static_cast<Eigen::Index>(6 * num_slots));
  points_.resize(count, static_cast<Eigen::Index>(3 * num_points));
  const CalibrationTold nothing{Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count)};
  parts_.assign(kNumParts, {nothing, CalibrationColumns(count)});
}

void CalibrationBorder::begin(const BundleCalibration& calibration, const Eigen::VectorXd& change) {
  information_ = calibration.prior_information;
  gradient_ = calibration.prior_information * (change - calibration.prior_change);
  poses_.setZero();
  points_.setZero();
  for (CameraColumns& camera : cameras_) camera.columns.clear();
}

void CalibrationBorder::flush(CameraColumns& camera) {
  const Eigen::Index count = camera.columns.num_parameters();
  camera.columns.flush(information_.block(camera.first, camera.first, count, count),
                       gradient_.segment(camera.first, count));
}

void CalibrationBorder::begin_elimination(double damping) {
  for (CameraColumns& camera : cameras_) flush(camera);
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
  // Of all points at once, which is several times as fast as one by one; the lower halves do.
  reduced_information_.selfadjointView<Eigen::Lower>().rankUpdate(points_, -1.0);
  reduced_information_.triangularView<Eigen::Lower>() -= reduced_poses_ * solved;
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

CalibrationEvidence CalibrationBorder::evidence() {
  CalibrationEvidence evidence;
  evidence.whole = {Eigen::MatrixXd::Zero(gradient_.size(), gradient_.size()),
                    Eigen::VectorXd::Zero(gradient_.size())};
  for (auto& [told, columns] : parts_) {
    columns.flush(told.information, told.gradient);
    const Eigen::MatrixXd information = told.information.selfadjointView<Eigen::Lower>();
    evidence.parts.push_back({information, told.gradient});
    evidence.whole.information += information;
    evidence.whole.gradient += told.gradient;
  }
  return evidence;
}

}  // namespace waymark

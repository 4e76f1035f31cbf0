// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/bundle_problem.h"

namespace waymark {

Eigen::Map<const Eigen::Matrix2Xf> BundleCalibration::by_intrinsics(std::size_t observation,
                                                                    std::uint8_t camera) const {
  return {level_pixel_by_intrinsics.data() + first_derivative[observation],
          2,
          static_cast<Eigen::Index>(blocks[camera].num_intrinsics)};
}

Eigen::Vector2d BundleCalibration::pixel_shift(std::size_t observation,
                                               std::uint8_t camera,
                                               const Eigen::VectorXd& change) const {
  const auto derivative = by_intrinsics(observation, camera);
  const auto first = static_cast<Eigen::Index>(blocks[camera].first);
  return derivative.cast<double>().lazyProduct(change.segment(first, derivative.cols()));
}

Eigen::Map<const Eigen::RowVectorXf> BundleCalibration::inverse_range_by(
    std::size_t observation) const {
  if (inverse_range_by_intrinsics.empty()) return {nullptr, 0};
  const std::size_t count = blocks[0].num_intrinsics;
  return {inverse_range_by_intrinsics.data() + observation * count,
          static_cast<Eigen::Index>(count)};
}

double BundleCalibration::inverse_range_shift(std::size_t observation,
                                              const Eigen::VectorXd& change) const {
  const auto derivative = inverse_range_by(observation);
  return derivative.cast<double>().dot(change.head(derivative.cols()));
}

Rigid3 BundleCalibration::cam_from_rig(std::size_t camera, const Eigen::VectorXd& change) const {
  const CalibrationParameters::Block& block = blocks[camera];
  const Rigid3& before = rig->cameras[camera].cam_from_rig;
  if (!block.has_extrinsics) return before;
  const auto first = static_cast<Eigen::Index>(block.first + block.num_intrinsics);
  return turned(before, change.segment<5>(first));
}

}  // namespace waymark

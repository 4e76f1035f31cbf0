// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cstdint>

#include "waymark/base/check.h"
#include "waymark/camera/calibration.h"

namespace waymark {
namespace {

/// Differences are taken over this part of a usual standard deviation to either side.
constexpr double kStep = 0.01;

constexpr int kNumErrorTerms = 2 * BearingError::kNumTerms;

}  // namespace

std::optional<std::vector<double>> CalibrationParameters::pixel_by_intrinsics(
    std::size_t camera,
    const Eigen::VectorXd& change,
    std::span<const Eigen::Vector3d> bearings) const {
  const Block& block = blocks_[camera];
  std::vector<double> derivatives(2 * block.num_intrinsics * bearings.size(), 0.0);
  std::vector<Eigen::Vector2d> above(bearings.size()), below(bearings.size());
  std::vector<std::uint8_t> is_above(bearings.size()), is_below(bearings.size());
  const auto project = [&](std::size_t parameter, double step, auto& pixels, auto& is_visible) {
    Eigen::VectorXd stepped = change;
    stepped[static_cast<Eigen::Index>(parameter)] += step;
    given_.cameras[camera]
        .remake(description_at(camera, stepped))
        ->project(bearings, pixels, is_visible);
  };
  for (std::size_t p = 0; p < block.num_projection; ++p) {
    const std::size_t parameter = block.first + p;
    const double step = kStep * list_[parameter].usual_sigma;
    try {
      project(parameter, step, above, is_above);
      project(parameter, -step, below, is_below);
    } catch (const InputError&) {
      return std::nullopt;
    }
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      if (!is_above[i] || !is_below[i]) continue;
      double* const derivative = derivatives.data() + 2 * (block.num_intrinsics * i + p);
      Eigen::Map<Eigen::Vector2d>{derivative} = (above[i] - below[i]) / (2.0 * step);
    }
  }
  if (block.has_extrinsics) differentiate_by_bearing_error(camera, bearings, derivatives);
  return derivatives;
}

void CalibrationParameters::differentiate_by_bearing_error(
    std::size_t camera,
    std::span<const Eigen::Vector3d> bearings,
    std::vector<double>& derivatives) const {
  constexpr int kNumTerms = BearingError::kNumTerms;
  const auto by_angles = pixel_by_epipolar_angles(given_.cameras[camera], bearings);
  const Block& block = blocks_[camera];
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const BearingError::Terms terms = BearingError::terms(bearings[i]);
    double* const first =
        derivatives.data() + 2 * (block.num_intrinsics * i + block.num_projection);
    Eigen::Map<Eigen::Matrix<double, 2, kNumErrorTerms>> by_errors(first);
    by_errors.leftCols<kNumTerms>() = by_angles[i].col(0) * terms.transpose();
    by_errors.rightCols<kNumTerms>() = by_angles[i].col(1) * terms.transpose();
  }
}

std::vector<Eigen::Matrix2d> pixel_by_epipolar_angles(const RigCamera& camera,
                                                      std::span<const Eigen::Vector3d> bearings) {
  std::vector<Eigen::Vector2d> pixels(bearings.size());
  std::vector<Matrix23d> jacobians(bearings.size());
  std::vector<std::uint8_t> is_visible(bearings.size());
  camera.camera->project_with_jacobian(bearings, pixels, jacobians, is_visible);
  const Eigen::Vector3d baseline = camera.cam_from_rig.translation.normalized();
  std::vector<Eigen::Matrix2d> by_angles(bearings.size(), Eigen::Matrix2d::Zero());
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Eigen::Vector3d toward = baseline - baseline.dot(bearings[i]) * bearings[i];
    if (!is_visible[i] || !(toward.norm() > 0.0)) continue;
    const Eigen::Vector3d along = toward.normalized();
    by_angles[i] << jacobians[i] * along, jacobians[i] * bearings[i].cross(along);
  }
  return by_angles;
}

}  // namespace waymark

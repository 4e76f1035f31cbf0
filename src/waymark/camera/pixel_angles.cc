// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/pixel_angles.h"

#include <algorithm>
#include <array>
#include <span>

#include "waymark/camera/tangent.h"

namespace waymark {
namespace {

std::vector<double> column_stretches(const Camera& camera,
                                     const std::vector<Eigen::Vector2d>& pixels) {
  std::vector<Eigen::Vector3d> bearings(pixels.size(), Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector2d> projected(pixels.size());
  std::vector<Matrix23d> jacobians(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size()), is_visible(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  camera.project_with_jacobian(bearings, projected, jacobians, is_visible);
  std::vector<double> stretches;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const bool is_known = is_valid[i] && is_visible[i];
    const double ratio = is_known ? jacobians[i].row(0).norm() / jacobians[i].row(1).norm() : 1.0;
    stretches.push_back(std::max(1.0, ratio));
  }
  return stretches;
}

}  // namespace

PixelAngles::PixelAngles(const Camera& camera)
    : columns_((camera.width_px() + kCellPx - 1) / kCellPx) {
  const int rows = (camera.height_px() + kCellPx - 1) / kCellPx;
  std::vector<Eigen::Vector2d> centres;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns_; ++column) {
      centres.emplace_back(std::min((column + 0.5) * kCellPx, camera.width_px() - 1.0),
                           std::min((row + 0.5) * kCellPx, camera.height_px() - 1.0));
    }
  }
  const std::vector<float> level_scales(centres.size(), 1.0f);
  TangentComputer tangent;
  const TangentArrays& arrays = tangent.compute(camera, centres, level_scales);
  double last_valid = 1e-3;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (arrays.is_valid[i]) last_valid = arrays.size_rad[i];
    angles_rad_.push_back(last_valid);
  }
  if (camera.wrap_width_px() > 0.0) column_stretches_ = column_stretches(camera, centres);
}

double central_pixel_angle(const Camera& camera) {
  const Eigen::Vector2d centre(0.5 * camera.width_px(), 0.5 * camera.height_px());
  constexpr std::array<float, 1> kLevelScale = {1.0f};
  TangentComputer tangent;
  const TangentArrays& arrays = tangent.compute(camera, std::span(&centre, 1), kLevelScale);
  return arrays.is_valid[0] ? arrays.size_rad[0] : PixelAngles(camera).at(centre);
}

double part_without_bearing(const Camera& camera) {
  constexpr int kNumPerAxis = 40;
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < kNumPerAxis * kNumPerAxis; ++i) {
    const double column = (i % kNumPerAxis + 0.5) / kNumPerAxis;
    const double row = (i / kNumPerAxis + 0.5) / kNumPerAxis;
    pixels.emplace_back(camera.width_px() * column - 0.5, camera.height_px() * row - 0.5);
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  const auto num_invalid = std::count(is_valid.begin(), is_valid.end(), 0);
  return static_cast<double>(num_invalid) / static_cast<double>(pixels.size());
}

}  // namespace waymark

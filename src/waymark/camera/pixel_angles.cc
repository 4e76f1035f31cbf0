// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/pixel_angles.h"

#include "waymark/camera/tangent.h"

namespace waymark {

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
}

double central_pixel_angle(const Camera& camera) {
  return PixelAngles(camera).at({0.5 * camera.width_px(), 0.5 * camera.height_px()});
}

}  // namespace waymark

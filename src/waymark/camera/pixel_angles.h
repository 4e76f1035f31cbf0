// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/camera/camera.h"

namespace waymark {

/// The angle that one pixel of the full image subtends, tabulated over the image, so that the
/// expected pyramid level and the search radius of a landmark follow from its size without a call
/// into the camera model per point.
class PixelAngles {
 public:
  explicit PixelAngles(const Camera& camera);

  /// Radians per pixel near a pixel of the image (geometric mean over directions).
  double at(const Eigen::Vector2d& pixel) const { return angles_rad_[cell_of(pixel)]; }

  /// How many columns span the angle of one row near a pixel, at least 1: search windows of 360
  /// degree images widen by it towards the poles. 1 for cameras whose columns do not repeat.
  double column_stretch(const Eigen::Vector2d& pixel) const {
    return column_stretches_.empty() ? 1.0 : column_stretches_[cell_of(pixel)];
  }

 private:
  static constexpr int kCellPx = 16;

  std::size_t cell_of(const Eigen::Vector2d& pixel) const {
    const int column = static_cast<int>((pixel.x() + 0.5) / kCellPx);
    const int row = static_cast<int>((pixel.y() + 0.5) / kCellPx);
    return static_cast<std::size_t>(row * columns_ + column);
  }
  int columns_;
  std::vector<double> angles_rad_;
  std::vector<double> column_stretches_;
};

/// Angle in radians that a pixel at the centre of the image subtends.
double central_pixel_angle(const Camera& camera);

/// Part of the image's pixels that have no direction: outside of an image circle, or where the
/// calibration folds back. By a grid of pixels.
double part_without_bearing(const Camera& camera);

}  // namespace waymark

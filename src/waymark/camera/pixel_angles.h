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
  double at(const Eigen::Vector2d& pixel) const {
    const int column = static_cast<int>((pixel.x() + 0.5) / kCellPx);
    const int row = static_cast<int>((pixel.y() + 0.5) / kCellPx);
    return angles_rad_[static_cast<std::size_t>(row * columns_ + column)];
  }

 private:
  static constexpr int kCellPx = 16;
  int columns_;
  std::vector<double> angles_rad_;
};

/// Angle in radians that a pixel at the centre of the image subtends.
double central_pixel_angle(const Camera& camera);

}  // namespace waymark

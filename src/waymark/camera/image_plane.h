// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace waymark {

/// The last step of most models: u = fu x + cu, v = fv y + cv. Pixels; focal lengths positive.
struct ImagePlane {
  Eigen::Vector2d focal_px;
  Eigen::Vector2d center_px;

  Eigen::Vector2d to_pixel(const Eigen::Vector2d& point) const {
    return focal_px.cwiseProduct(point) + center_px;
  }
  Eigen::Vector2d from_pixel(const Eigen::Vector2d& pixel) const {
    return (pixel - center_px).cwiseQuotient(focal_px);
  }
};

}  // namespace waymark

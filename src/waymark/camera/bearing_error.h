// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace waymark {

/// What the bearings of the second camera of a stereo pair are off by, as angles along and across
/// the epipolar lines that are smooth over the image: what rectification and lens models leave. A
/// quadratic polynomial of the bearing, without the constant, which is a turn of the camera.
struct BearingError {
  static constexpr int kNumTerms = 5;  ///< Of the polynomial.
  /// Coefficients of the polynomial, or its terms, as terms() orders them.
  using Terms = Eigen::Matrix<double, kNumTerms, 1>;

  Terms along_rad = Terms::Zero();   ///< Per term: seen too far along the line, as if too near.
  Terms across_rad = Terms::Zero();  ///< Too far in the direction of bearing x (direction along).

  /// x, y, x^2, x y, y^2 of a unit bearing in the camera.
  static Terms terms(const Eigen::Vector3d& bearing) {
    const double x = bearing.x(), y = bearing.y();
    return {x, y, x * x, x * y, y * y};
  }
  /// Along the epipolar line and across it.
  Eigen::Vector2d at(const Eigen::Vector3d& bearing) const {
    const Terms of_bearing = terms(bearing);
    return {along_rad.dot(of_bearing), across_rad.dot(of_bearing)};
  }
};

}  // namespace waymark

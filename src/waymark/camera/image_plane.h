// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <numbers>

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

/// Part of its slope in the centre below which a projection is taken to fold back: a pixel says
/// next to nothing about its direction there, and two directions share one beyond.
inline constexpr double kMinRelativeSlope = 0.05;

/// The angle off the axis, in (0, pi] rad, at which the field of view of an axially symmetric
/// projection ends. slope(angle) is the derivative of the distance from the centre of the image by
/// the angle, at most 0 where there is no projection, and positive at 0. The first angle is found
/// at which it falls below kMinRelativeSlope * slope(0).
template <class Slope>
double find_max_angle(const Slope& slope) {
  constexpr int kNumSteps = 2048;
  const double least = kMinRelativeSlope * slope(0.0);
  const auto is_inside = [&](double angle) { return slope(angle) >= least; };
  double low = 0.0;
  for (int step = 1; step <= kNumSteps; ++step) {
    double high = std::numbers::pi * step / kNumSteps;
    if (is_inside(high)) {
      low = high;
      continue;
    }
    for (;;) {
      const double middle = 0.5 * (low + high);
      if (!(low < middle && middle < high)) return low;
      (is_inside(middle) ? low : high) = middle;
    }
  }
  return std::numbers::pi;
}

}  // namespace waymark

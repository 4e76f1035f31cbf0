// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/fisheye.h"

#include <algorithm>

#include "waymark/camera/image_plane.h"

namespace waymark {

FisheyeModel::FisheyeModel(const ImagePlane& plane, const std::array<double, 4>& coeffs)
    : plane_(plane),
      coeffs_(coeffs),
      max_angle_rad_(find_max_angle([this](double angle) { return slope(angle); })),
      max_radius_(radius(max_angle_rad_)) {}

/// Newton's method, kept between bounds that each step narrows: the radius grows all the way.
double FisheyeModel::angle_of(double wanted_radius) const {
  double low = 0.0, high = max_angle_rad_;
  double angle = std::min(wanted_radius, high);
  for (int step = 0; step < 60; ++step) {
    const double excess = radius(angle) - wanted_radius;
    (excess < 0.0 ? low : high) = angle;
    double next = angle - excess / slope(angle);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = std::abs(next - angle);
    angle = next;
    if (change <= 1e-15 * angle) break;
  }
  return angle;
}

Matrix23d FisheyeModel::jacobian(const Eigen::Vector3d& point_in_cam) const {
  Matrix23d result;
  const double side = point_in_cam.head<2>().norm();
  if (side == 0.0) {
    result << Eigen::Matrix2d::Identity() / point_in_cam.z(), Eigen::Vector2d::Zero();
    return plane_.focal_px.asDiagonal() * result;
  }
  const double angle = std::atan2(side, point_in_cam.z());
  const Eigen::Vector2d outward = point_in_cam.head<2>() / side;
  const Eigen::Vector2d sideways(-outward.y(), outward.x());
  const double slope_by_length = slope(angle) / point_in_cam.squaredNorm();
  result.leftCols<2>() = slope_by_length * point_in_cam.z() * outward * outward.transpose() +
                         radius(angle) / side * sideways * sideways.transpose();
  result.col(2) = -slope_by_length * side * outward;
  return plane_.focal_px.asDiagonal() * result;
}

}  // namespace waymark

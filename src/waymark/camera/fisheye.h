// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "waymark/camera/image_plane.h"
#include "waymark/camera/model_camera.h"

namespace waymark {

/// Fisheye camera of Kannala and Brandt (2006, A generic camera model and calibration method for
/// conventional, wide-angle, and fish-eye lenses, eq. 6), with the first coefficient 1 as in OpenCV
/// and in Kalibr's "equidistant" distortion. With t the angle off the axis:
///
///   radius(t) = t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9
///   (x, y) = radius(t) * (X, Y) / |(X, Y)|,  u = fu x + cu, v = fv y + cv
///
/// Nothing in it ends at 180 degrees. The field of view ends where the radius stops growing, or
/// straight behind the camera.
class FisheyeModel {
 public:
  static constexpr std::string_view kName = "fisheye";

  FisheyeModel(const ImagePlane& plane, const std::array<double, 4>& coeffs)
      : plane_(plane),
        coeffs_(coeffs),
        max_angle_rad_(find_max_angle([this](double angle) { return slope(angle); })),
        max_radius_(radius(max_angle_rad_)) {}

  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends, at most pi.
  double max_angle_rad() const { return max_angle_rad_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double side = point_in_cam.head<2>().norm();
    const double angle = std::atan2(side, point_in_cam.z());
    if (!(angle < max_angle_rad_) || !std::isfinite(side)) return std::nullopt;
    if (side == 0.0) return plane_.center_px;
    return plane_.to_pixel(radius(angle) / side * point_in_cam.head<2>());
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d point = plane_.from_pixel(pixel);
    const double distance = point.norm();
    if (!(distance < max_radius_)) return std::nullopt;
    if (distance == 0.0) return Eigen::Vector3d(0.0, 0.0, 1.0);
    const double angle = angle_of(distance);
    const double scale = std::sin(angle) / distance;
    return Eigen::Vector3d(scale * point.x(), scale * point.y(), std::cos(angle)).normalized();
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const {
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

 private:
  double radius(double angle) const {
    const double s = angle * angle;
    return angle * (1.0 + s * (coeffs_[0] + s * (coeffs_[1] + s * (coeffs_[2] + s * coeffs_[3]))));
  }
  double slope(double angle) const {
    const double s = angle * angle;
    return 1.0 + s * (3.0 * coeffs_[0] +
                      s * (5.0 * coeffs_[1] + s * (7.0 * coeffs_[2] + s * 9.0 * coeffs_[3])));
  }
  /// Newton's method, kept between bounds that each step narrows: the radius grows all the way.
  double angle_of(double wanted_radius) const {
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

  ImagePlane plane_;
  std::array<double, 4> coeffs_;
  double max_angle_rad_;
  double max_radius_;
};

using FisheyeCamera = ModelCamera<FisheyeModel>;

}  // namespace waymark

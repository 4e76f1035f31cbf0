// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string_view>

#include "waymark/camera/image_plane.h"
#include "waymark/camera/model_camera.h"

namespace waymark {

/// Radial division camera (Fitzgibbon 2001, Simultaneous linear estimation of multiple view
/// geometry and lens distortion, eq. 2): a pixel whose offset from the centre is (x, y), in focal
/// lengths, looks along
///
///   (x, y, 1 + k (x^2 + y^2))
///
/// k < 0 (barrel) covers all directions but straight back. k > 0 ends where the angle off the axis
/// stops growing with the distance from the centre.
class DivisionModel {
 public:
  static constexpr std::string_view kName = "division";

  DivisionModel(const ImagePlane& plane, double coefficient) : plane_(plane), k_(coefficient) {
    if (k_ > 0.0) max_radius_squared_ = (1.0 - kMinRelativeSlope) / k_;
  }

  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends.
  double max_angle_rad() const {
    if (k_ < 0.0) return std::numbers::pi;
    if (k_ == 0.0) return 0.5 * std::numbers::pi;
    return std::atan2(std::sqrt(max_radius_squared_), 1.0 + k_ * max_radius_squared_);
  }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double under_root = discriminant(point_in_cam);
    if (!(under_root > 0.0) || !(k_ < 0.0 || point_in_cam.z() > 0.0)) return std::nullopt;
    const double scale = scale_of(point_in_cam, std::sqrt(under_root));
    const Eigen::Vector2d point = scale * point_in_cam.head<2>();
    if (!(point.squaredNorm() <= max_radius_squared_)) return std::nullopt;
    return plane_.to_pixel(point);
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d point = plane_.from_pixel(pixel);
    const double s = point.squaredNorm();
    if (!(s <= max_radius_squared_) || !std::isfinite(s)) return std::nullopt;
    return Eigen::Vector3d(point.x(), point.y(), 1.0 + k_ * s).normalized();
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const {
    const double root = std::sqrt(discriminant(point_in_cam));
    const double scale = scale_of(point_in_cam, root);
    // Of scale Z = 1 + k scale^2 (X^2 + Y^2), which defines the scale.
    Eigen::RowVector3d scale_from_point;
    scale_from_point << 2.0 * k_ * scale * scale * point_in_cam.head<2>().transpose(), -scale;
    scale_from_point /= root;
    Matrix23d result = point_in_cam.head<2>() * scale_from_point;
    result.diagonal().array() += scale;
    return plane_.focal_px.asDiagonal() * result;
  }

 private:
  double discriminant(const Eigen::Vector3d& p) const {
    return p.z() * p.z() - 4.0 * k_ * p.head<2>().squaredNorm();
  }
  /// The root of k s^2 (X^2 + Y^2) - s Z + 1 = 0 that is 1 / Z without distortion, in the form that
  /// does not cancel.
  double scale_of(const Eigen::Vector3d& p, double root) const {
    if (p.z() >= 0.0) return 2.0 / (p.z() + root);
    return (p.z() - root) / (2.0 * k_ * p.head<2>().squaredNorm());
  }

  ImagePlane plane_;
  double k_;
  double max_radius_squared_ = std::numeric_limits<double>::infinity();
};

}  // namespace waymark

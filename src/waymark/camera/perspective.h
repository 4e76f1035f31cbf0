// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "waymark/camera/model_camera.h"
#include "waymark/camera/radial_tangential.h"

namespace waymark {

/// Perspective camera with radial and tangential distortion (radial_tangential.h; none, 4, 5 or 8
/// coefficients) of x = X / Z, y = Y / Z:
///
///   u = fu x' + cu, v = fv y' + cv
///
/// The field of view ends where x' stops growing with the radius, since two directions share a
/// pixel beyond. Not visible are points there and points behind the camera (Z <= 0).
class PerspectiveModel {
 public:
  static constexpr std::string_view kName = "pinhole";

  /// focal_px and center_px as (horizontal, vertical), focal lengths positive; see above for the
  /// coefficients.
  PerspectiveModel(const Eigen::Vector2d& focal_px,
                   const Eigen::Vector2d& center_px,
                   std::span<const double> distortion_coeffs = {});

  const Eigen::Vector2d& focal_px() const { return focal_px_; }
  const Eigen::Vector2d& center_px() const { return center_px_; }
  bool is_distorted() const { return distortion_.is_distorted(); }
  /// Angle off the axis at which the field of view ends, of that without tangential distortion.
  double max_angle_rad() const { return std::atan(std::sqrt(max_radius_squared())); }
  /// Square of the radius (X^2 + Y^2) / Z^2 at which the field of view ends; may be infinite.
  double max_radius_squared() const { return distortion_.max_radius_squared(); }
  /// Distance from the centre, in units of the focal length, at which the field of view ends in the
  /// image if there were no tangential distortion; may be infinite.
  double max_distorted_radius() const { return distortion_.max_distorted_radius(); }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    if (!(point_in_cam.z() > 0.0)) return std::nullopt;
    const Eigen::Vector2d ideal = point_in_cam.head<2>() / point_in_cam.z();
    if (!distortion_.is_distorted()) return to_pixel(ideal);
    if (!(ideal.squaredNorm() <= distortion_.max_radius_squared())) return std::nullopt;
    return to_pixel(distortion_.distort(ideal));
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d distorted = (pixel - center_px_).cwiseQuotient(focal_px_);
    if (!std::isfinite(distorted.squaredNorm())) return std::nullopt;
    if (!distortion_.is_distorted()) return to_bearing(distorted);
    const std::optional<Eigen::Vector2d> ideal = distortion_.undistort(distorted);
    if (!ideal) return std::nullopt;
    return to_bearing(*ideal);
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  Eigen::Vector2d to_pixel(const Eigen::Vector2d& normalized) const {
    return focal_px_.cwiseProduct(normalized) + center_px_;
  }
  static Eigen::Vector3d to_bearing(const Eigen::Vector2d& ideal) {
    const double scale = 1.0 / std::sqrt(1.0 + ideal.squaredNorm());
    return {scale * ideal.x(), scale * ideal.y(), scale};
  }

  Eigen::Vector2d focal_px_;
  Eigen::Vector2d center_px_;
  RadialTangential distortion_;
};

using PerspectiveCamera = ModelCamera<PerspectiveModel>;

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/camera/image_plane.h"
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
                   std::span<const double> distortion_coeffs = {})
      : plane_{focal_px, center_px}, distortion_(distortion_coeffs) {
    WAYMARK_CHECK(focal_px.x() > 0.0 && focal_px.y() > 0.0);
  }

  const Eigen::Vector2d& focal_px() const { return plane_.focal_px; }
  const Eigen::Vector2d& center_px() const { return plane_.center_px; }
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
    if (!distortion_.is_distorted()) return plane_.to_pixel(ideal);
    if (!(ideal.squaredNorm() <= distortion_.max_radius_squared())) return std::nullopt;
    return plane_.to_pixel(distortion_.distort(ideal));
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d distorted = plane_.from_pixel(pixel);
    if (!std::isfinite(distorted.squaredNorm())) return std::nullopt;
    if (!distortion_.is_distorted()) return to_bearing(distorted);
    const std::optional<Eigen::Vector2d> ideal = distortion_.undistort(distorted);
    if (!ideal) return std::nullopt;
    return to_bearing(*ideal);
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const {
    const double inverse_depth = 1.0 / point_in_cam.z();
    const Eigen::Vector2d ideal = point_in_cam.head<2>() * inverse_depth;
    Matrix23d ideal_from_point;
    ideal_from_point << inverse_depth, 0.0, -ideal.x() * inverse_depth,  //
        0.0, inverse_depth, -ideal.y() * inverse_depth;
    if (!distortion_.is_distorted()) return plane_.focal_px.asDiagonal() * ideal_from_point;
    return plane_.focal_px.asDiagonal() * distortion_.distort_with_jacobian(ideal).jacobian *
           ideal_from_point;
  }

 private:
  static Eigen::Vector3d to_bearing(const Eigen::Vector2d& ideal) {
    const double scale = 1.0 / std::sqrt(1.0 + ideal.squaredNorm());
    return {scale * ideal.x(), scale * ideal.y(), scale};
  }

  ImagePlane plane_;
  RadialTangential distortion_;
};

using PerspectiveCamera = ModelCamera<PerspectiveModel>;

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "waymark/camera/image_plane.h"
#include "waymark/camera/model_camera.h"
#include "waymark/camera/radial_tangential.h"

namespace waymark {

/// Unified camera for mirrors and fisheye lenses: projection to the unit sphere, then from a centre
/// xi behind that of the sphere, then radial and tangential distortion (Mei and Rives 2007, Single
/// view point omnidirectional camera calibration from planar grids, section II; Geyer and
/// Daniilidis 2000). Kalibr's "omni".
///
///   (x, y) = (X, Y) / (Z + xi |P|),  u = fu x' + cu, v = fv y' + cv
///
/// The field of view ends where the denominator vanishes (xi <= 1), where x stops growing with the
/// angle off the axis (xi > 1), or where the distortion ends.
class UnifiedModel {
 public:
  static constexpr std::string_view kName = "omni";

  /// xi >= 0; none, 4 or 5 coefficients k1 k2 p1 p2 [k3].
  UnifiedModel(double xi, const ImagePlane& plane, std::span<const double> distortion_coeffs = {});

  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends.
  double max_angle_rad() const { return max_angle_rad_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double distance = point_in_cam.norm();
    if (!(point_in_cam.z() > min_cosine_ * distance)) return std::nullopt;
    const Eigen::Vector2d ideal = point_in_cam.head<2>() / (point_in_cam.z() + xi_ * distance);
    if (!distortion_.is_distorted()) return plane_.to_pixel(ideal);
    if (!(ideal.squaredNorm() <= distortion_.max_radius_squared())) return std::nullopt;
    return plane_.to_pixel(distortion_.distort(ideal));
  }

  /// Mei and Rives 2007, eq. 2.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    Eigen::Vector2d point = plane_.from_pixel(pixel);
    if (!std::isfinite(point.squaredNorm())) return std::nullopt;
    if (distortion_.is_distorted()) {
      const std::optional<Eigen::Vector2d> ideal = distortion_.undistort(point);
      if (!ideal) return std::nullopt;
      point = *ideal;
    }
    const double s = point.squaredNorm();
    const double root = 1.0 + (1.0 - xi_ * xi_) * s;
    if (!(root >= 0.0)) return std::nullopt;
    const double scale = (xi_ + std::sqrt(root)) / (1.0 + s);
    const Eigen::Vector3d bearing =
        Eigen::Vector3d(scale * point.x(), scale * point.y(), scale - xi_).normalized();
    if (!(bearing.z() > min_cosine_)) return std::nullopt;
    return bearing;
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double find_end() const;

  double xi_;
  ImagePlane plane_;
  RadialTangential distortion_;
  double max_angle_rad_;
  double min_cosine_;
};

using UnifiedCamera = ModelCamera<UnifiedModel>;

}  // namespace waymark

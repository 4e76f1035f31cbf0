// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "waymark/camera/model_camera.h"

namespace waymark {

/// Perspective camera with radial and tangential distortion (Brown 1966), in the rational form and
/// the order of coefficients of OpenCV: k1 k2 p1 p2 [k3 [k4 k5 k6]]; none, 4, 5 or 8 of them.
///
///   x = X / Z, y = Y / Z, s = x^2 + y^2
///   radial = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
///   x' = x radial + 2 p1 x y + p2 (s + 2 x^2),  y' = y radial + p1 (s + 2 y^2) + 2 p2 x y
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
  bool is_distorted() const { return is_distorted_; }
  /// Square of the radius (X^2 + Y^2) / Z^2 at which the field of view ends; may be infinite.
  double max_radius_squared() const { return max_radius_squared_; }
  /// Distance from the centre, in units of the focal length, at which the field of view ends in the
  /// image if there were no tangential distortion; may be infinite.
  double max_distorted_radius() const { return max_distorted_radius_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    if (!(point_in_cam.z() > 0.0)) return std::nullopt;
    const Eigen::Vector2d ideal = point_in_cam.head<2>() / point_in_cam.z();
    if (!is_distorted_) return to_pixel(ideal);
    if (!(ideal.squaredNorm() <= max_radius_squared_)) return std::nullopt;
    return to_pixel(distort(ideal));
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d distorted = (pixel - center_px_).cwiseQuotient(focal_px_);
    if (!std::isfinite(distorted.squaredNorm())) return std::nullopt;
    if (!is_distorted_) return to_bearing(distorted);
    const std::optional<Eigen::Vector2d> ideal = undistort(distorted);
    if (!ideal) return std::nullopt;
    return to_bearing(*ideal);
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  struct Distorted {
    Eigen::Vector2d value;
    Eigen::Matrix2d jacobian;
  };

  Eigen::Vector2d to_pixel(const Eigen::Vector2d& normalized) const {
    return focal_px_.cwiseProduct(normalized) + center_px_;
  }
  static Eigen::Vector3d to_bearing(const Eigen::Vector2d& ideal) {
    const double scale = 1.0 / std::sqrt(1.0 + ideal.squaredNorm());
    return {scale * ideal.x(), scale * ideal.y(), scale};
  }
  void find_field_of_view();
  Eigen::Vector2d distort(const Eigen::Vector2d& ideal) const;
  Distorted distort_with_jacobian(const Eigen::Vector2d& ideal) const;
  std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> solve(const Eigen::Vector2d& distorted,
                                       Eigen::Vector2d ideal) const;
  double radial_inverse(double distorted_radius) const;

  Eigen::Vector2d focal_px_;
  Eigen::Vector2d center_px_;
  std::array<double, 8> coeffs_{};  // In OpenCV's order, zero where not given.
  bool is_distorted_ = false;
  double max_radius_squared_;
  double max_distorted_radius_;
};

using PerspectiveCamera = ModelCamera<PerspectiveModel>;

}  // namespace waymark

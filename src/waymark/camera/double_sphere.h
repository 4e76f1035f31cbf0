// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <string_view>

#include "waymark/camera/image_plane.h"
#include "waymark/camera/model_camera.h"

namespace waymark {

/// Double sphere camera (Usenko, Demmel and Cremers 2018, The double sphere camera model, eq. 40 to
/// 46). Kalibr's "ds".
///
///   w = Z + xi |P|,  d = |(X, Y, w)|
///   (x, y) = (X, Y) / (alpha d + (1 - alpha) w),  u = fu x + cu, v = fv y + cv
///
/// The field of view ends where the denominator vanishes (alpha <= 0.5) or where x stops growing
/// with the angle off the axis.
class DoubleSphereModel {
 public:
  static constexpr std::string_view kName = "ds";

  /// xi in (-1, 1], alpha in [0, 1].
  DoubleSphereModel(double xi, double alpha, const ImagePlane& plane);

  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends.
  double max_angle_rad() const { return max_angle_rad_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double distance = point_in_cam.norm();
    if (!(point_in_cam.z() > min_cosine_ * distance)) return std::nullopt;
    const double w = point_in_cam.z() + xi_ * distance;
    const double d = std::sqrt(point_in_cam.head<2>().squaredNorm() + w * w);
    return plane_.to_pixel(point_in_cam.head<2>() / (alpha_ * d + (1.0 - alpha_) * w));
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d point = plane_.from_pixel(pixel);
    const double s = point.squaredNorm();
    const double under_root = 1.0 - (2.0 * alpha_ - 1.0) * s;
    if (!(under_root >= 0.0) || !std::isfinite(s)) return std::nullopt;
    const double height =
        (1.0 - alpha_ * alpha_ * s) / (alpha_ * std::sqrt(under_root) + 1.0 - alpha_);
    const double second = height * height + (1.0 - xi_ * xi_) * s;
    if (!(second >= 0.0)) return std::nullopt;
    const double scale = (height * xi_ + std::sqrt(second)) / (height * height + s);
    const Eigen::Vector3d bearing =
        Eigen::Vector3d(scale * point.x(), scale * point.y(), scale * height - xi_).normalized();
    if (!(bearing.z() > min_cosine_)) return std::nullopt;
    return bearing;
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double find_end() const;

  double xi_;
  double alpha_;
  ImagePlane plane_;
  double max_angle_rad_;
  double min_cosine_;
};

using DoubleSphereCamera = ModelCamera<DoubleSphereModel>;

}  // namespace waymark

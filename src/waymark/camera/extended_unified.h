// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <string_view>

#include "waymark/camera/image_plane.h"
#include "waymark/camera/model_camera.h"

namespace waymark {

/// Extended unified camera (Khomutenko, Garcia and Martinet 2016, An enhanced unified camera model;
/// in the form of Usenko, Demmel and Cremers 2018, The double sphere camera model, section II D).
///
///   d = sqrt(beta (X^2 + Y^2) + Z^2)
///   (x, y) = (X, Y) / (alpha d + (1 - alpha) Z),  u = fu x + cu, v = fv y + cv
///
/// The field of view ends where the denominator vanishes (alpha <= 0.5) or where x stops growing
/// with the angle off the axis.
class ExtendedUnifiedModel {
 public:
  static constexpr std::string_view kName = "eucm";

  /// alpha in [0, 1], beta > 0.
  ExtendedUnifiedModel(double alpha, double beta, const ImagePlane& plane);

  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends.
  double max_angle_rad() const { return max_angle_rad_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    if (!(point_in_cam.z() > min_cosine_ * point_in_cam.norm())) return std::nullopt;
    const double denominator = alpha_ * root(point_in_cam) + (1.0 - alpha_) * point_in_cam.z();
    return plane_.to_pixel(point_in_cam.head<2>() / denominator);
  }

  /// Usenko et al. 2018, eq. 19 to 21.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d point = plane_.from_pixel(pixel);
    const double s = beta_ * point.squaredNorm();
    const double under_root = 1.0 - (2.0 * alpha_ - 1.0) * s;
    if (!(under_root >= 0.0) || !std::isfinite(s)) return std::nullopt;
    const double height =
        (1.0 - alpha_ * alpha_ * s) / (alpha_ * std::sqrt(under_root) + 1.0 - alpha_);
    const Eigen::Vector3d bearing = Eigen::Vector3d(point.x(), point.y(), height).normalized();
    if (!(bearing.z() > min_cosine_)) return std::nullopt;
    return bearing;
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double root(const Eigen::Vector3d& point_in_cam) const {
    return std::sqrt(beta_ * point_in_cam.head<2>().squaredNorm() +
                     point_in_cam.z() * point_in_cam.z());
  }
  double find_end() const;

  double alpha_;
  double beta_;
  ImagePlane plane_;
  double max_angle_rad_;
  double min_cosine_;
};

using ExtendedUnifiedCamera = ModelCamera<ExtendedUnifiedModel>;

}  // namespace waymark

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

/// What the models below share: an image plane, and a field of view that ends at an angle.
class SphereProjection {
 public:
  const ImagePlane& plane() const { return plane_; }
  /// Angle off the axis at which the field of view ends.
  double max_angle_rad() const { return max_angle_rad_; }

 protected:
  explicit SphereProjection(const ImagePlane& plane) : plane_(plane) {}
  void end_at(double angle_rad) {
    max_angle_rad_ = angle_rad;
    min_cosine_ = std::cos(angle_rad);
  }
  /// Nothing outside of the field of view.
  std::optional<Eigen::Vector3d> bearing_of(const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d bearing = direction.normalized();
    if (!(bearing.z() > min_cosine_)) return std::nullopt;
    return bearing;
  }

  ImagePlane plane_;
  double max_angle_rad_ = 0.0;
  double min_cosine_ = 1.0;
};

/// Unified camera for mirrors and fisheye lenses: projection to the unit sphere, then from a centre
/// xi behind that of the sphere, then radial and tangential distortion (Mei and Rives 2007, Single
/// view point omnidirectional camera calibration from planar grids, section II; Geyer and
/// Daniilidis 2000). Kalibr's "omni".
///
///   (x, y) = (X, Y) / (Z + xi |P|),  u = fu x' + cu, v = fv y' + cv
///
/// The field of view ends where the denominator vanishes (xi <= 1), where x stops growing with the
/// angle off the axis (xi > 1), or where the distortion ends.
class UnifiedModel : public SphereProjection {
 public:
  static constexpr std::string_view kName = "omni";

  /// xi >= 0; none, 4 or 5 coefficients k1 k2 p1 p2 [k3].
  UnifiedModel(double xi, const ImagePlane& plane, std::span<const double> distortion_coeffs = {});

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
    return bearing_of(Eigen::Vector3d(scale * point.x(), scale * point.y(), scale - xi_));
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double xi_;
  RadialTangential distortion_;
};

/// Extended unified camera (Khomutenko, Garcia and Martinet 2016, An enhanced unified camera model;
/// in the form of Usenko, Demmel and Cremers 2018, The double sphere camera model, section II D).
///
///   d = sqrt(beta (X^2 + Y^2) + Z^2)
///   (x, y) = (X, Y) / (alpha d + (1 - alpha) Z),  u = fu x + cu, v = fv y + cv
///
/// The field of view ends where the denominator vanishes (alpha <= 0.5) or where x stops growing
/// with the angle off the axis.
class ExtendedUnifiedModel : public SphereProjection {
 public:
  static constexpr std::string_view kName = "eucm";

  /// alpha in [0, 1], beta > 0.
  ExtendedUnifiedModel(double alpha, double beta, const ImagePlane& plane);

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
    return bearing_of(Eigen::Vector3d(point.x(), point.y(), height));
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double root(const Eigen::Vector3d& point_in_cam) const {
    return std::sqrt(beta_ * point_in_cam.head<2>().squaredNorm() +
                     point_in_cam.z() * point_in_cam.z());
  }
  double alpha_;
  double beta_;
};

/// Double sphere camera (Usenko, Demmel and Cremers 2018, The double sphere camera model, eq. 40 to
/// 46). Kalibr's "ds".
///
///   w = Z + xi |P|,  d = |(X, Y, w)|
///   (x, y) = (X, Y) / (alpha d + (1 - alpha) w),  u = fu x + cu, v = fv y + cv
///
/// The field of view ends where the denominator vanishes (alpha <= 0.5) or where x stops growing
/// with the angle off the axis.
class DoubleSphereModel : public SphereProjection {
 public:
  static constexpr std::string_view kName = "ds";

  /// xi in (-1, 1], alpha in [0, 1].
  DoubleSphereModel(double xi, double alpha, const ImagePlane& plane);

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
    return bearing_of(Eigen::Vector3d(scale * point.x(), scale * point.y(), scale * height - xi_));
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;

 private:
  double xi_;
  double alpha_;
};

}  // namespace waymark

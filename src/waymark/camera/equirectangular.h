// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

#include "waymark/camera/model_camera.h"

namespace waymark {

/// All directions in one image, columns by longitude, rows by latitude (plate carree; Snyder 1987,
/// Map projections: a working manual, chapter 12). The centre of the image looks along +z; columns
/// repeat after the width. With the width w and the height h in pixels:
///
///   u + 0.5 = w (0.5 + atan2(X, Z) / 2 pi),  v + 0.5 = h (0.5 + atan2(Y, |(X, Z)|) / pi)
///
/// The poles themselves, straight up and down, have no column and are not visible.
class EquirectangularModel {
 public:
  static constexpr std::string_view kName = "equirectangular";

  EquirectangularModel(int width_px, int height_px)
      : width_px_(width_px),
        px_per_rad_(0.5 * width_px * std::numbers::inv_pi, height_px * std::numbers::inv_pi),
        center_px_(0.5 * width_px - 0.5, 0.5 * height_px - 0.5) {}

  double wrap_width_px() const { return width_px_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double side = std::hypot(point_in_cam.x(), point_in_cam.z());
    if (!(side > 0.0) || !std::isfinite(side)) return std::nullopt;
    const double longitude = std::atan2(point_in_cam.x(), point_in_cam.z());
    const double latitude = std::atan2(point_in_cam.y(), side);
    if (std::isnan(latitude)) return std::nullopt;
    Eigen::Vector2d pixel =
        center_px_ + px_per_rad_.cwiseProduct(Eigen::Vector2d(longitude, latitude));
    if (pixel.x() >= width_px_ - 0.5) pixel.x() -= width_px_;  // Straight back.
    return pixel;
  }

  /// Any column, for they repeat; rows of the image.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d angles = (pixel - center_px_).cwiseQuotient(px_per_rad_);
    if (!(std::abs(angles.y()) < 0.5 * std::numbers::pi)) return std::nullopt;
    if (!std::isfinite(angles.x())) return std::nullopt;
    const double side = std::cos(angles.y());
    return Eigen::Vector3d(
        side * std::sin(angles.x()), std::sin(angles.y()), side * std::cos(angles.x()));
  }

  Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const {
    const double x = point_in_cam.x(), y = point_in_cam.y(), z = point_in_cam.z();
    const double side = std::hypot(x, z);
    const double squared = point_in_cam.squaredNorm();
    Matrix23d result;
    result << z / (side * side), 0.0, -x / (side * side),  //
        -x * y / (side * squared), side / squared, -y * z / (side * squared);
    return px_per_rad_.asDiagonal() * result;
  }

 private:
  double width_px_;
  Eigen::Vector2d px_per_rad_;
  Eigen::Vector2d center_px_;
};

using EquirectangularCamera = ModelCamera<EquirectangularModel>;

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/unified.h"

#include "waymark/base/check.h"
#include "waymark/camera/max_angle.h"

namespace waymark {

UnifiedModel::UnifiedModel(double xi,
                           const ImagePlane& plane,
                           std::span<const double> distortion_coeffs)
    : xi_(xi),
      plane_(plane),
      distortion_(distortion_coeffs),
      max_angle_rad_(find_end()),
      min_cosine_(std::cos(max_angle_rad_)) {
  WAYMARK_CHECK(xi >= 0.0);
}

double UnifiedModel::find_end() const {
  return find_max_angle([this](double angle) {
    const double denominator = std::cos(angle) + xi_;
    if (!(denominator > 0.0)) return 0.0;
    const double radius = std::sin(angle) / denominator;
    if (!(radius * radius <= distortion_.max_radius_squared())) return 0.0;
    return (1.0 + xi_ * std::cos(angle)) / (denominator * denominator);
  });
}

Matrix23d UnifiedModel::jacobian(const Eigen::Vector3d& point_in_cam) const {
  const double distance = point_in_cam.norm();
  const double inverse = 1.0 / (point_in_cam.z() + xi_ * distance);
  const Eigen::Vector2d ideal = point_in_cam.head<2>() * inverse;
  Eigen::RowVector3d denominator_from_point = xi_ / distance * point_in_cam.transpose();
  denominator_from_point.z() += 1.0;
  Matrix23d ideal_from_point = -inverse * ideal * denominator_from_point;
  ideal_from_point.diagonal().array() += inverse;
  if (distortion_.is_distorted()) {
    ideal_from_point = distortion_.distort_with_jacobian(ideal).jacobian * ideal_from_point;
  }
  return plane_.focal_px.asDiagonal() * ideal_from_point;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/unified.h"

#include "waymark/base/check.h"

namespace waymark {

UnifiedModel::UnifiedModel(double xi,
                           const ImagePlane& plane,
                           std::span<const double> distortion_coeffs)
    : SphereProjection(plane), xi_(xi), distortion_(distortion_coeffs) {
  WAYMARK_CHECK(xi >= 0.0);
  end_at(find_max_angle([this](double angle) {
    const double denominator = std::cos(angle) + xi_;
    if (!(denominator > 0.0)) return 0.0;
    const double radius = std::sin(angle) / denominator;
    if (!(radius * radius <= distortion_.max_radius_squared())) return 0.0;
    return (1.0 + xi_ * std::cos(angle)) / (denominator * denominator);
  }));
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

ExtendedUnifiedModel::ExtendedUnifiedModel(double alpha, double beta, const ImagePlane& plane)
    : SphereProjection(plane), alpha_(alpha), beta_(beta) {
  WAYMARK_CHECK(alpha >= 0.0 && alpha <= 1.0 && beta > 0.0);
  end_at(find_max_angle([this](double angle) {
    const double d = root({std::sin(angle), 0.0, std::cos(angle)});
    const double denominator = alpha_ * d + (1.0 - alpha_) * std::cos(angle);
    if (!(denominator > 0.0)) return 0.0;
    return (1.0 - alpha_ + alpha_ * std::cos(angle) / d) / (denominator * denominator);
  }));
}

Matrix23d ExtendedUnifiedModel::jacobian(const Eigen::Vector3d& point_in_cam) const {
  const double d = root(point_in_cam);
  const double inverse = 1.0 / (alpha_ * d + (1.0 - alpha_) * point_in_cam.z());
  const Eigen::RowVector3d denominator_from_point(alpha_ * beta_ * point_in_cam.x() / d,
                                                  alpha_ * beta_ * point_in_cam.y() / d,
                                                  alpha_ * point_in_cam.z() / d + 1.0 - alpha_);
  Matrix23d point_from_point = -inverse * inverse * point_in_cam.head<2>() * denominator_from_point;
  point_from_point.diagonal().array() += inverse;
  return plane_.focal_px.asDiagonal() * point_from_point;
}

DoubleSphereModel::DoubleSphereModel(double xi, double alpha, const ImagePlane& plane)
    : SphereProjection(plane), xi_(xi), alpha_(alpha) {
  WAYMARK_CHECK(xi > -1.0 && xi <= 1.0 && alpha >= 0.0 && alpha <= 1.0);
  // The slope is that of the angle at the second sphere by the angle at the first, times that of
  // x by the former.
  end_at(find_max_angle([this](double angle) {
    const double cosine = std::cos(angle);
    const double squared = 1.0 + 2.0 * xi_ * cosine + xi_ * xi_;
    const double second_cosine = (cosine + xi_) / std::sqrt(squared);
    const double denominator = alpha_ + (1.0 - alpha_) * second_cosine;
    if (!(denominator > 0.0) || !(squared > 0.0)) return 0.0;
    return (1.0 + xi_ * cosine) / squared * (alpha_ * second_cosine + 1.0 - alpha_) /
           (denominator * denominator);
  }));
}

Matrix23d DoubleSphereModel::jacobian(const Eigen::Vector3d& point_in_cam) const {
  const double distance = point_in_cam.norm();
  const double w = point_in_cam.z() + xi_ * distance;
  const double d = std::sqrt(point_in_cam.head<2>().squaredNorm() + w * w);
  const double inverse = 1.0 / (alpha_ * d + (1.0 - alpha_) * w);
  Eigen::RowVector3d w_from_point = xi_ / distance * point_in_cam.transpose();
  w_from_point.z() += 1.0;
  Eigen::RowVector3d d_from_point = w / d * w_from_point;
  d_from_point.head<2>() += point_in_cam.head<2>().transpose() / d;
  Matrix23d result = -inverse * inverse * point_in_cam.head<2>() *
                     (alpha_ * d_from_point + (1.0 - alpha_) * w_from_point);
  result.diagonal().array() += inverse;
  return plane_.focal_px.asDiagonal() * result;
}

}  // namespace waymark

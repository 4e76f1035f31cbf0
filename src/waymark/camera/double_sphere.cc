// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/double_sphere.h"

#include "waymark/base/check.h"
#include "waymark/camera/max_angle.h"

namespace waymark {

DoubleSphereModel::DoubleSphereModel(double xi, double alpha, const ImagePlane& plane)
    : xi_(xi),
      alpha_(alpha),
      plane_(plane),
      max_angle_rad_(find_end()),
      min_cosine_(std::cos(max_angle_rad_)) {
  WAYMARK_CHECK(xi > -1.0 && xi <= 1.0 && alpha >= 0.0 && alpha <= 1.0);
}

/// The slope is that of the angle at the second sphere by the angle at the first, times that of
/// x by the former.
double DoubleSphereModel::find_end() const {
  return find_max_angle([this](double angle) {
    const double cosine = std::cos(angle);
    const double squared = 1.0 + 2.0 * xi_ * cosine + xi_ * xi_;
    const double second_cosine = (cosine + xi_) / std::sqrt(squared);
    const double denominator = alpha_ + (1.0 - alpha_) * second_cosine;
    if (!(denominator > 0.0) || !(squared > 0.0)) return 0.0;
    return (1.0 + xi_ * cosine) / squared * (alpha_ * second_cosine + 1.0 - alpha_) /
           (denominator * denominator);
  });
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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/extended_unified.h"

#include "waymark/base/check.h"
#include "waymark/camera/max_angle.h"

namespace waymark {

ExtendedUnifiedModel::ExtendedUnifiedModel(double alpha, double beta, const ImagePlane& plane)
    : alpha_(alpha),
      beta_(beta),
      plane_(plane),
      max_angle_rad_(find_end()),
      min_cosine_(std::cos(max_angle_rad_)) {
  WAYMARK_CHECK(alpha >= 0.0 && alpha <= 1.0 && beta > 0.0);
}

double ExtendedUnifiedModel::find_end() const {
  return find_max_angle([this](double angle) {
    const double d = root({std::sin(angle), 0.0, std::cos(angle)});
    const double denominator = alpha_ * d + (1.0 - alpha_) * std::cos(angle);
    if (!(denominator > 0.0)) return 0.0;
    return (1.0 - alpha_ + alpha_ * std::cos(angle) / d) / (denominator * denominator);
  });
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

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/perspective.h"

#include "waymark/base/check.h"

namespace waymark {

PerspectiveModel::PerspectiveModel(const Eigen::Vector2d& focal_px,
                                   const Eigen::Vector2d& center_px,
                                   std::span<const double> distortion_coeffs)
    : focal_px_(focal_px), center_px_(center_px), distortion_(distortion_coeffs) {
  WAYMARK_CHECK(focal_px.x() > 0.0 && focal_px.y() > 0.0);
}

Matrix23d PerspectiveModel::jacobian(const Eigen::Vector3d& point_in_cam) const {
  const double inverse_depth = 1.0 / point_in_cam.z();
  const Eigen::Vector2d ideal = point_in_cam.head<2>() * inverse_depth;
  Matrix23d ideal_from_point;
  ideal_from_point << inverse_depth, 0.0, -ideal.x() * inverse_depth,  //
      0.0, inverse_depth, -ideal.y() * inverse_depth;
  if (!distortion_.is_distorted()) return focal_px_.asDiagonal() * ideal_from_point;
  return focal_px_.asDiagonal() * distortion_.distort_with_jacobian(ideal).jacobian *
         ideal_from_point;
}

}  // namespace waymark

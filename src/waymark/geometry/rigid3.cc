// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/rigid3.h"

#include "waymark/geometry/so3.h"

namespace waymark {

Eigen::Matrix4d Rigid3::matrix() const {
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  result.topLeftCorner<3, 3>() = rotation_matrix();
  result.topRightCorner<3, 1>() = translation;
  return result;
}

Rigid3 Rigid3::exp(const Vector6d& tangent) {
  const Eigen::Vector3d rho = tangent.head<3>();
  const Eigen::Vector3d phi = tangent.tail<3>();
  return {so3_exp(phi), so3_left_jacobian(phi) * rho};  // Sola et al. 2018, eq. 172
}

Vector6d Rigid3::log() const {
  const Eigen::Vector3d phi = so3_log(rotation);
  Vector6d tangent;
  tangent << so3_left_jacobian_inverse(phi) * translation, phi;  // Sola et al. 2018, eq. 173
  return tangent;
}

Matrix6d Rigid3::adjoint() const {
  const Eigen::Matrix3d matrix = rotation_matrix();
  Matrix6d result = Matrix6d::Zero();  // Sola et al. 2018, eq. 175
  result.topLeftCorner<3, 3>() = matrix;
  result.topRightCorner<3, 3>() = skew(translation) * matrix;
  result.bottomRightCorner<3, 3>() = matrix;
  return result;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/geometry/rigid3.h"

namespace waymark {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// Similarity b_from_a: point_in_b = scale * (rotation * point_in_a) + translation. Tangent vectors
/// are (rho, phi, sigma), sigma = log of the scale; perturbations on the left (Strasdat 2012;
/// Eade).
struct Sim3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double scale = 1.0;

  Sim3() = default;
  Sim3(const Eigen::Quaterniond& rotation_in,
       const Eigen::Vector3d& translation_in,
       double scale_in)
      : rotation(rotation_in), translation(translation_in), scale(scale_in) {}
  explicit Sim3(const Rigid3& rigid) : rotation(rigid.rotation), translation(rigid.translation) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
  Sim3 operator*(const Sim3& other) const {
    return {(rotation * other.rotation).normalized(),
            scale * (rotation * other.translation) + translation,
            scale * other.scale};
  }
  Sim3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation) / scale, 1.0 / scale};
  }

  static Sim3 exp(const Vector7d& tangent);
  Vector7d log() const;
  /// xi_b = adjoint(b_from_a) * xi_a.
  Matrix7d adjoint() const;
};

/// Inverse of the left Jacobian of Sim(3): log(exp(d) exp(a)) ~ a + J_l^-1(a) d.
Matrix7d sim3_left_jacobian_inverse(const Vector7d& tangent);

}  // namespace waymark

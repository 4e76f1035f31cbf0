// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/geometry/rigid3.h"

namespace waymark {

using Vector7d = Eigen::Matrix<double, 7, 1>;  ///< Tangent vector (rho, phi, sigma) of Sim3.
using Matrix7d = Eigen::Matrix<double, 7, 7>;  ///< Linear map of such tangent vectors.

/// Similarity b_from_a: point_in_b = scale * (rotation * point_in_a) + translation. Tangent vectors
/// are (rho, phi, sigma), sigma = log of the scale; perturbations on the left (Strasdat 2012;
/// Eade).
struct Sim3 {
  /// Unit: rotates vectors of a into b.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< The origin of a in b, in units of b.
  double scale = 1.0;  ///< Length in b of what has length 1 in a; positive.

  Sim3() = default;
  /// rotation_in must have unit length, scale_in be positive.
  Sim3(const Eigen::Quaterniond& rotation_in,
       const Eigen::Vector3d& translation_in,
       double scale_in)
      : rotation(rotation_in), translation(translation_in), scale(scale_in) {}
  /// The same motion, with scale 1.
  explicit Sim3(const Rigid3& rigid) : rotation(rigid.rotation), translation(rigid.translation) {}

  /// The point, given in a, in b.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
  /// c_from_b * b_from_a gives c_from_a, its rotation normalized.
  Sim3 operator*(const Sim3& other) const {
    return {(rotation * other.rotation).normalized(),
            scale * (rotation * other.translation) + translation,
            scale * other.scale};
  }
  /// a_from_b.
  Sim3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation) / scale, 1.0 / scale};
  }

  /// Exponential map of Sim(3); inverse of log() for rotations below pi.
  static Sim3 exp(const Vector7d& tangent);
  /// Logarithm of Sim(3), with a rotation angle of at most pi.
  Vector7d log() const;
  /// xi_b = adjoint(b_from_a) * xi_a.
  Matrix7d adjoint() const;
};

/// Inverse of the left Jacobian of Sim(3): log(exp(d) exp(a)) ~ a + J_l^-1(a) d.
Matrix7d sim3_left_jacobian_inverse(const Vector7d& tangent);

}  // namespace waymark

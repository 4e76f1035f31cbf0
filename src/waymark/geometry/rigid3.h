// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace waymark {

#ifdef WAYMARK_ALIGNMENT
static_assert(alignof(Eigen::Quaterniond) == WAYMARK_ALIGNMENT,
              "Eigen's alignment depends on the instruction set: compile for the one that the "
              "installed Waymark was built for, or build Waymark with the same flags (-march=...)");
#endif

/// Skew-symmetric matrix: skew(a) * b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Exponential of SO(3); the rotation vector is in radians (Sola et al. 2018, 3.3).
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector);
/// Its logarithm.
Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation);

/// Left Jacobian J_l of SO(3): exp((a + J_l^-1(a) d)) ~ exp(d) exp(a).
Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& rotation_vector);
/// Its inverse.
Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& rotation_vector);

/// Tangent vector (rho, phi) of Rigid3, in metres and radians.
using Vector6d = Eigen::Matrix<double, 6, 1>;
/// Linear map, or covariance, of such tangent vectors.
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rigid motion, named b_from_a: point_in_b = b_from_a * point_in_a. Adjacent frames of a product
/// must match. Tangent vectors are (translation rho, rotation phi), perturbations on the left:
/// exp(xi) * b_from_a (Sola et al. 2018).
struct Rigid3 {
  /// Unit: rotates vectors of a into b.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  /// The origin of a in b, in metres (map units where the scale is free).
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  /// rotation_in must have unit length.
  Rigid3(const Eigen::Quaterniond& rotation_in, const Eigen::Vector3d& translation_in)
      : rotation(rotation_in), translation(translation_in) {}

  /// The point, given in a, in b.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  /// c_from_b * b_from_a gives c_from_a, its rotation normalized.
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  /// a_from_b.
  Rigid3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  /// The rotation as an orthonormal 3x3 matrix.
  Eigen::Matrix3d rotation_matrix() const { return rotation.toRotationMatrix(); }
  /// Homogeneous 4x4 matrix, last row 0 0 0 1.
  Eigen::Matrix4d matrix() const;
  /// The origin of b in frame a; for cam_from_world the camera centre in the world.
  Eigen::Vector3d origin_in_source() const { return -(rotation.conjugate() * translation); }

  /// Exponential map of SE(3), exact for all angles; inverse of log() below pi.
  static Rigid3 exp(const Vector6d& tangent);
  /// Logarithm of SE(3), with a rotation angle of at most pi.
  Vector6d log() const;
  /// xi_b = adjoint(b_from_a) * xi_a.
  Matrix6d adjoint() const;
};

}  // namespace waymark

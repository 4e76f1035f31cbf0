// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace waymark {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rigid motion, named b_from_a: point_in_b = b_from_a * point_in_a. Adjacent frames of a product
/// must match. Tangent vectors are (translation rho, rotation phi), perturbations on the left:
/// exp(xi) * b_from_a (Sola et al. 2018).
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  Rigid3(const Eigen::Quaterniond& rotation_in, const Eigen::Vector3d& translation_in)
      : rotation(rotation_in), translation(translation_in) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  Rigid3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  Eigen::Matrix3d rotation_matrix() const { return rotation.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;
  /// The origin of b in frame a; for cam_from_world the camera centre in the world.
  Eigen::Vector3d origin_in_source() const { return -(rotation.conjugate() * translation); }

  static Rigid3 exp(const Vector6d& tangent);
  Vector6d log() const;
  /// xi_b = adjoint(b_from_a) * xi_a.
  Matrix6d adjoint() const;
};

}  // namespace waymark

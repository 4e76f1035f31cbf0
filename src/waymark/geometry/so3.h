// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace waymark {

/// Skew-symmetric matrix: skew(a) * b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Exponential and logarithm of SO(3); the rotation vector is in radians (Sola et al. 2018, 3.3).
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector);
Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation);

/// Left Jacobian of SO(3) and its inverse: exp((a + J_l^-1(a) d)) ~ exp(d) exp(a).
Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& rotation_vector);
Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& rotation_vector);

}  // namespace waymark

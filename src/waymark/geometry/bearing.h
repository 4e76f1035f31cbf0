// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <span>

namespace waymark {

/// Angle between two non-zero vectors in [0, pi], exact for tiny angles, where acos is not.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Two orthonormal columns that complete the unit vector n to a right-handed basis
/// (Duff et al. 2017, Building an Orthonormal Basis, Revisited, listing 3).
inline Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& n) {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  const double b = n.x() * n.y() * a;
  Eigen::Matrix<double, 3, 2> basis;
  basis << 1.0 + sign * n.x() * n.x() * a, b,  //
      sign * b, sign + n.y() * n.y() * a,      //
      -sign * n.x(), -n.y();
  return basis;
}

/// Matched unit bearings of two views, each in the frame of its own view, and the standard
/// deviation of each bearing's direction in radians, per axis of the tangent plane (> 0). A view:
/// the arrays belong to the caller and run in parallel.
struct BearingMatches {
  std::span<const Eigen::Vector3d> bearings_a;
  std::span<const Eigen::Vector3d> bearings_b;
  std::span<const double> sigmas_rad_a;
  std::span<const double> sigmas_rad_b;

  std::size_t size() const { return bearings_a.size(); }
};

}  // namespace waymark

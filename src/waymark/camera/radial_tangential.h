// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

namespace waymark {

/// Radial and tangential distortion (Brown 1966) of points (x, y) of a plane, in the rational form
/// and the order of coefficients of OpenCV: k1 k2 p1 p2 [k3 [k4 k5 k6]]; none, 4, 5 or 8 of them.
///
///   s = x^2 + y^2
///   radial = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
///   x' = x radial + 2 p1 x y + p2 (s + 2 x^2),  y' = y radial + p1 (s + 2 y^2) + 2 p2 x y
///
/// Holds up to the radius where x' stops growing with it, since two points share an image beyond.
class RadialTangential {
 public:
  struct Distorted {
    Eigen::Vector2d value;
    Eigen::Matrix2d jacobian;
  };

  explicit RadialTangential(std::span<const double> coeffs);

  /// Whether any coefficient differs from 0. Without, the functions below need not be called.
  bool is_distorted() const { return is_distorted_; }
  /// Square of the radius up to which the distortion holds; may be infinite.
  double max_radius_squared() const { return max_radius_squared_; }
  /// Where that radius comes to lie without tangential distortion; may be infinite.
  double max_distorted_radius() const { return max_distorted_radius_; }

  Eigen::Vector2d distort(const Eigen::Vector2d& ideal) const;
  Distorted distort_with_jacobian(const Eigen::Vector2d& ideal) const;
  /// Inverse of distort; nothing where there is none within the largest radius.
  std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& distorted) const;

 private:
  void find_largest_radius();
  std::optional<Eigen::Vector2d> solve(const Eigen::Vector2d& distorted,
                                       Eigen::Vector2d ideal) const;
  double radial_inverse(double distorted_radius) const;

  std::array<double, 8> coeffs_{};  // In OpenCV's order, zero where not given.
  bool is_distorted_ = false;
  double max_radius_squared_;
  double max_distorted_radius_;
};

}  // namespace waymark

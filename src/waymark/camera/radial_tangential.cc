// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/radial_tangential.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/base/check.h"
#include "waymark/camera/polynomial.h"

namespace waymark {
namespace {

// The distortion holds until it compresses a step to less than this part of what it covers in the
// centre: closer to the fold a pixel says nothing about its direction.
constexpr double kMinSlope = 0.05;
// Tangent of 80 degrees, where a distorted perspective camera's field of view ends at the latest:
// the tangential terms grow with the squared radius and would fold farther points back into the
// image, though the radial ones do not.
constexpr double kLargestRadius = 5.67;
// In squared units of the focal length. Newton's step squares the error, so that the step taken
// with this residual is the last that changes anything.
constexpr double kLastStepResidual = 1e-15;
constexpr double kAcceptedResidual = 1e-24;
constexpr int kMaxSteps = 12;

}  // namespace

RadialTangential::RadialTangential(std::span<const double> coeffs)
    : max_radius_squared_(std::numeric_limits<double>::infinity()),
      max_distorted_radius_(std::numeric_limits<double>::infinity()) {
  WAYMARK_CHECK(coeffs.empty() || coeffs.size() == 4 || coeffs.size() == 5 || coeffs.size() == 8);
  std::copy(coeffs.begin(), coeffs.end(), coeffs_.begin());
  is_distorted_ = std::any_of(coeffs_.begin(), coeffs_.end(), [](double c) { return c != 0.0; });
  if (is_distorted_) find_largest_radius();
}

void RadialTangential::find_largest_radius() {
  // With s = r^2 and radial = N(s) / D(s), the slope of r radial is (N D + 2 s (N' D - N D')) /
  // D^2.
  const Polynomial numerator = {1.0, coeffs_[0], coeffs_[1], coeffs_[4]};
  const Polynomial denominator = {1.0, coeffs_[5], coeffs_[6], coeffs_[7]};
  const Polynomial change = sum(product(derivative(numerator), denominator),
                                product(numerator, derivative(denominator)),
                                -1.0);
  const Polynomial slope = sum(product(numerator, denominator), product({0.0, 2.0}, change));
  const Polynomial excess = sum(slope, product(denominator, denominator), -kMinSlope);

  double end = kLargestRadius * kLargestRadius;
  for (const Polynomial* polynomial : {&excess, &denominator}) {
    const std::vector<double> roots = roots_between(*polynomial, 0.0, end);
    if (!roots.empty()) end = roots.front();
  }
  max_radius_squared_ = end;
  max_distorted_radius_ = std::sqrt(end) * evaluate(numerator, end) / evaluate(denominator, end);
}

Eigen::Vector2d RadialTangential::distort(const Eigen::Vector2d& ideal) const {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = coeffs_;
  const double x = ideal.x(), y = ideal.y();
  const double s = x * x + y * y;
  const double radial = (1.0 + s * (k1 + s * (k2 + s * k3))) / (1.0 + s * (k4 + s * (k5 + s * k6)));
  return {x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
          y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y};
}

RadialTangential::Distorted RadialTangential::distort_with_jacobian(
    const Eigen::Vector2d& ideal) const {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = coeffs_;
  const double x = ideal.x(), y = ideal.y();
  const double s = x * x + y * y;
  const double inverse = 1.0 / (1.0 + s * (k4 + s * (k5 + s * k6)));
  const double radial = (1.0 + s * (k1 + s * (k2 + s * k3))) * inverse;
  // Twice the derivative of the radial factor by s; times x or y it is that by x or y.
  const double slope =
      2.0 * inverse *
      ((k1 + s * (2.0 * k2 + s * 3.0 * k3)) - radial * (k4 + s * (2.0 * k5 + s * 3.0 * k6)));
  const double cross = x * y * slope + 2.0 * (p1 * x + p2 * y);
  Distorted result;
  result.value << x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
      y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y;
  result.jacobian << radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, cross, cross,
      radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return result;
}

std::optional<Eigen::Vector2d> RadialTangential::undistort(const Eigen::Vector2d& distorted) const {
  // Started at the distorted position, Newton's method approaches from one side, for barrel and
  // for pincushion distortion alike; it can fail only where the two mix.
  if (const auto ideal = solve(distorted, distorted)) return ideal;
  const double radius = distorted.norm();
  if (!(radius < max_distorted_radius_)) return std::nullopt;
  return solve(distorted, distorted * (radial_inverse(radius) / radius));
}

std::optional<Eigen::Vector2d> RadialTangential::solve(const Eigen::Vector2d& distorted,
                                                       Eigen::Vector2d ideal) const {
  for (int step = 0; step < kMaxSteps; ++step) {
    const double radius_squared = ideal.squaredNorm();
    if (radius_squared > max_radius_squared_) {
      ideal *= std::sqrt(max_radius_squared_ / radius_squared);
    }
    const Distorted estimate = distort_with_jacobian(ideal);
    const Eigen::Vector2d residual = distorted - estimate.value;
    const auto& j = estimate.jacobian;
    const double determinant = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0);
    if (!(determinant > 0.0)) return std::nullopt;
    ideal.x() += (j(1, 1) * residual.x() - j(0, 1) * residual.y()) / determinant;
    ideal.y() += (j(0, 0) * residual.y() - j(1, 0) * residual.x()) / determinant;
    if (residual.squaredNorm() < kLastStepResidual) break;
  }
  const bool is_solved = (distort(ideal) - distorted).squaredNorm() < kAcceptedResidual &&
                         ideal.squaredNorm() <= max_radius_squared_;
  return is_solved ? std::optional(ideal) : std::nullopt;
}

double RadialTangential::radial_inverse(double distorted_radius) const {
  const auto& k = coeffs_;
  double low = 0.0, high = std::sqrt(max_radius_squared_);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high), s = middle * middle;
    const double radial =
        (1.0 + s * (k[0] + s * (k[1] + s * k[4]))) / (1.0 + s * (k[5] + s * (k[6] + s * k[7])));
    (middle * radial < distorted_radius ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace waymark

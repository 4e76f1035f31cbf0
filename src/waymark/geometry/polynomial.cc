// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/polynomial.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/base/check.h"

namespace waymark {
namespace {

// Ascending coefficients.
struct BoundedPolynomial {
  std::array<double, kMaxPolynomialDegree + 1> coefficients{};
  std::size_t degree = 0;

  double operator()(double x) const {
    double sum = coefficients[degree];
    for (std::size_t i = degree; i-- > 0;) sum = sum * x + coefficients[i];
    return sum;
  }

  BoundedPolynomial derivative() const {
    BoundedPolynomial result;
    result.degree = degree - 1;
    for (std::size_t i = 1; i <= degree; ++i) {
      result.coefficients[i - 1] = static_cast<double>(i) * coefficients[i];
    }
    return result;
  }
};

// The root in [low, high], at whose ends the polynomial has different signs: Newton's method, with
// bisection wherever its step leaves the bracket.
double bracketed_root(const BoundedPolynomial& polynomial,
                      const BoundedPolynomial& derivative,
                      double low,
                      double high) {
  constexpr int kMaxIterations = 100;
  const bool rises = polynomial(low) < 0.0;
  double x = 0.5 * (low + high);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const double value = polynomial(x);
    if (value == 0.0) return x;
    ((value < 0.0) == rises ? low : high) = x;
    double next = x - value / derivative(x);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double change = std::abs(next - x);
    x = next;
    if (change <= 2.0 * std::numeric_limits<double>::epsilon()) break;
  }
  return x;
}

// Roots in [-1, 1] in ascending order.
RealRoots roots_in_unit_interval(const BoundedPolynomial& polynomial) {
  RealRoots roots;
  if (polynomial.degree == 0) return roots;
  const BoundedPolynomial derivative = polynomial.derivative();
  const RealRoots turns = roots_in_unit_interval(derivative);

  double low = -1.0;
  double value_at_low = polynomial(low);
  for (std::size_t i = 0; i <= turns.size; ++i) {
    const double high = i < turns.size ? turns.values[i] : 1.0;
    const double value_at_high = polynomial(high);
    // The upper end counts as part of a piece, the lower one only for the first.
    if (i == 0 && value_at_low == 0.0) {
      roots.values[roots.size++] = low;
    } else if (value_at_high == 0.0 && high > low) {
      roots.values[roots.size++] = high;
    } else if (value_at_low * value_at_high < 0.0) {
      roots.values[roots.size++] = bracketed_root(polynomial, derivative, low, high);
    }
    if (roots.size == polynomial.degree) break;
    low = high;
    value_at_low = value_at_high;
  }
  return roots;
}

}  // namespace

RealRoots real_roots(std::span<const double> coefficients) {
  WAYMARK_CHECK(!coefficients.empty() && coefficients.size() <= kMaxPolynomialDegree + 1);
  BoundedPolynomial polynomial;
  polynomial.degree = coefficients.size() - 1;
  double largest = 0.0;
  for (const double coefficient : coefficients) {
    if (!std::isfinite(coefficient)) return {};
    largest = std::max(largest, std::abs(coefficient));
  }
  if (largest == 0.0) return {};
  // Scaled to one, so that products of two values do not underflow.
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    polynomial.coefficients[i] = coefficients[i] / largest;
  }
  BoundedPolynomial reversed = polynomial;
  std::reverse(reversed.coefficients.begin(),
               reversed.coefficients.begin() + static_cast<std::ptrdiff_t>(polynomial.degree) + 1);

  RealRoots roots = roots_in_unit_interval(polynomial);
  for (const double inverse : roots_in_unit_interval(reversed)) {
    if (std::abs(inverse) >= 1.0 || inverse == 0.0 || roots.size == polynomial.degree) continue;
    roots.values[roots.size++] = 1.0 / inverse;
  }
  std::sort(roots.values.begin(), roots.values.begin() + static_cast<std::ptrdiff_t>(roots.size));
  return roots;
}

}  // namespace waymark

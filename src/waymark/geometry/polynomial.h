// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace waymark {

inline constexpr std::size_t kMaxPolynomialDegree = 10;

struct RealRoots {
  std::array<double, kMaxPolynomialDegree> values{};
  std::size_t size = 0;

  const double* begin() const { return values.data(); }
  const double* end() const { return values.data() + size; }
};

/// Real roots of coefficients[0] + coefficients[1] x + coefficients[2] x^2 + ... of degree at most
/// kMaxPolynomialDegree; leading coefficients may be zero. Where the polynomial touches zero
/// without crossing it, rounding decides between no root and two.
///
/// The roots of the derivative cut the axis into pieces in which the polynomial is monotonic, so
/// each root is bracketed. The reversed polynomial maps |x| > 1 into (-1, 1): no bound on the roots
/// is needed.
RealRoots real_roots(std::span<const double> coefficients);

}  // namespace waymark

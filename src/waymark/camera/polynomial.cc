// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/polynomial.h"

#include <algorithm>

namespace waymark {
namespace {

/// The root in [low, high], at whose ends the signs differ; until the interval cannot be halved.
double bisect(const Polynomial& polynomial, double low, double high) {
  const bool is_negative_at_low = evaluate(polynomial, low) < 0.0;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (!(low < middle && middle < high)) return middle;
    ((evaluate(polynomial, middle) < 0.0) == is_negative_at_low ? low : high) = middle;
  }
}

}  // namespace

double evaluate(const Polynomial& polynomial, double x) {
  double value = 0.0;
  for (std::size_t i = polynomial.size(); i-- > 0;) value = value * x + polynomial[i];
  return value;
}

Polynomial derivative(const Polynomial& polynomial) {
  Polynomial result;
  for (std::size_t i = 1; i < polynomial.size(); ++i) {
    result.push_back(static_cast<double>(i) * polynomial[i]);
  }
  return result;
}

Polynomial product(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return {};
  Polynomial result(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) result[i + j] += a[i] * b[j];
  }
  return result;
}

Polynomial sum(const Polynomial& a, const Polynomial& b, double factor_of_b) {
  Polynomial result(std::max(a.size(), b.size()), 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) result[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) result[i] += factor_of_b * b[i];
  return result;
}

std::vector<double> roots_between(const Polynomial& polynomial, double low, double high) {
  if (polynomial.size() < 2) return {};
  std::vector<double> ends = roots_between(derivative(polynomial), low, high);
  ends.insert(ends.begin(), low);
  ends.push_back(high);
  std::vector<double> roots;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const bool is_negative = evaluate(polynomial, ends[i]) < 0.0;
    if (is_negative != (evaluate(polynomial, ends[i + 1]) < 0.0)) {
      roots.push_back(bisect(polynomial, ends[i], ends[i + 1]));
    }
  }
  return roots;
}

}  // namespace waymark

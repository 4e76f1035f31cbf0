// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace waymark {

/// Sums over pairs of grey values with weights, from which follows how alike two images are.
struct Correlation {
  double n = 0.0;  ///< Of the weights.
  double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;

  /// A pair.
  void add(double in_a, double in_b, double weight = 1.0) {
    n += weight;
    a += weight * in_a;
    b += weight * in_b;
    aa += weight * in_a * in_a;
    bb += weight * in_b * in_b;
    ab += weight * in_a * in_b;
  }

  /// Variance of the grey values of a, times n.
  double scatter_a() const { return aa - a * a / n; }
  /// Variance of the grey values of b, times n.
  double scatter_b() const { return bb - b * b / n; }
  /// Pearson's coefficient, from -1 to 1. Both images must vary.
  double coefficient() const { return (ab - a * b / n) / std::sqrt(scatter_a() * scatter_b()); }
};

}  // namespace waymark

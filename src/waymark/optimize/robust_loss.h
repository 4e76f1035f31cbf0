// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace waymark {

/// Value of a robust loss and its derivative, both by the squared residual s. The derivative is
/// the weight of iteratively reweighted least squares (Triggs et al. 2000, 4.3).
struct RobustValue {
  double loss = 0.0;
  double weight = 1.0;
};

/// Huber 1964: s up to scale^2, then linear in the residual, 2 * scale * sqrt(s) - scale^2.
inline RobustValue huber(double squared_residual, double scale) {
  if (!(squared_residual > scale * scale)) return {squared_residual, 1.0};
  const double residual = std::sqrt(squared_residual);
  return {2.0 * scale * residual - scale * scale, scale / residual};
}

/// Geman and McClure 1985, shape -2 of the family of Barron 2019 up to a constant factor:
/// scale^2 * s / (scale^2 + s). Tends to scale^2, so that gross outliers stop pulling.
inline RobustValue geman_mcclure(double squared_residual, double scale) {
  const double share = scale * scale / (scale * scale + squared_residual);
  return {share * squared_residual, share * share};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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

/// The standard deviation of Gaussian errors by the median of their lengths.
inline constexpr float kSigmaOfMedian = 1.4826f;
/// Huber's scale in standard deviations at which 95 % of the efficiency of least squares is left.
inline constexpr float kHuberSigmas95 = 1.345f;

/// The weight of Huber's loss by the error itself, as of grey values.
inline float huber_weight(float error, float scale) {
  return std::min(1.0f, scale / std::max(std::abs(error), 1e-6f));
}

/// The weight of Geman and McClure's loss by the squared scale.
inline double geman_mcclure_weight(double squared_residual, double squared_scale) {
  const double share = squared_scale / (squared_scale + squared_residual);
  return share * share;
}

/// Geman and McClure 1985, shape -2 of the family of Barron 2019 up to a constant factor:
/// scale^2 * s / (scale^2 + s). Tends to scale^2, so that gross outliers stop pulling.
inline RobustValue geman_mcclure(double squared_residual, double scale) {
  const double share = scale * scale / (scale * scale + squared_residual);
  return {share * squared_residual, share * share};
}

}  // namespace waymark

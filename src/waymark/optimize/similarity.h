// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/geometry/ransac.h"
#include "waymark/geometry/sim3.h"
#include "waymark/optimize/similarity_residual.h"

namespace waymark {

struct SimilarityOptions {
  /// Otherwise the scale is 1: what both cameras know is metric.
  bool is_scale_free = true;
  /// Standard deviation that a component of a residual is assumed to have, in pixels of the
  /// feature's level. It covers the error of the landmarks, too.
  double noise_px = 1.0;
  /// A match is an inlier while the squared residuals of both sides sum up to less than
  /// gate_chi2 * noise_px^2; the default is the 95 % quantile of chi-square with 4 degrees of
  /// freedom.
  double gate_chi2 = 9.488;
};

struct SimilarityEstimate {
  Sim3 b_from_a;
  std::vector<std::uint8_t> is_inlier;  ///< Per match.
  std::size_t num_inliers = 0;
  /// Of the left perturbation in exp(xi) * b_from_a by the noise of the bearings and the
  /// ranges' ratios; large but finite where the matches say nothing, zero for a scale that is
  /// fixed.
  Matrix7d covariance = Matrix7d::Zero();
  /// Standard deviation of the logarithm of the ratio of the inliers' ranges, as measured (0 for a
  /// fixed scale).
  double range_noise = 0.0;
  double mean_squared_residual_px2 = 0.0;  ///< Per inlier, both sides summed; 4 components.
};

/// The similarity (or rigid motion) b_from_a on which most matches agree: RANSAC on three points
/// each (Horn 1987, in the form of Umeyama 1991), scored by the residuals in both cameras, then
/// refine_similarity(). Nothing if no model has more support than a sample. Repeatable by bits.
std::optional<SimilarityEstimate> find_similarity(const LandmarkMatches& matches,
                                                  const SimilarityOptions& options,
                                                  const RansacOptions& ransac_options);

/// Refines b_from_a by Levenberg-Marquardt on the residuals of all matches, of which up to about
/// half may be wrong: under the loss of Geman & McClure, whose scale shrinks (Yang et al. 2020),
/// then under that of Huber on what passes the gate. Where the scale is free, the ratio of the
/// landmarks' ranges counts, too, by its noise as the matches show it, and under the same loss; it
/// does not decide what is an inlier. A fixed scale stays as it is given.
SimilarityEstimate refine_similarity(const LandmarkMatches& matches,
                                     const Sim3& initial_b_from_a,
                                     const SimilarityOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/geometry/ransac.h"
#include "waymark/geometry/sim3.h"

namespace waymark {

/// Pairs of landmarks that may be the same thing, one of each pair known and seen by camera a, the
/// other by camera b. Points are in the frame of the camera that sees them, in the units of its
/// part of the map. Parallel arrays.
struct LandmarkMatches {
  struct Side {
    std::vector<Eigen::Vector3d> point_in_cam;
    std::vector<Eigen::Vector3f> bearing;             ///< Measured, unit.
    std::vector<Matrix23f> level_pixel_from_bearing;  ///< W of Features.

    void add(const Eigen::Vector3d& point, const Measurement& measured) {
      point_in_cam.push_back(point);
      bearing.push_back(measured.bearing);
      level_pixel_from_bearing.push_back(measured.level_pixel_from_bearing);
    }
  };
  Side a, b;

  std::size_t size() const { return a.point_in_cam.size(); }
};

/// Residuals of one match and their derivatives by the left perturbation of b_from_a.
struct SimilarityResidual {
  /// W * (predicted - measured bearing) of the landmark of a in b, then of that of b in a.
  Eigen::Vector4d value;
  Eigen::Matrix<double, 4, 7> jacobian;
  /// Logarithm of the ratio of the ranges, in b, of the landmark of a and that of b. Bearings tell
  /// the scale by the distance of the cameras only, and there may be none.
  double log_range_ratio = 0.0;
  Eigen::Matrix<double, 1, 7> log_range_jacobian = Eigen::Matrix<double, 1, 7>::Zero();
};

/// Nothing if a landmark is more than 90 degrees from its bearing, or if a value is not finite.
std::optional<SimilarityResidual> similarity_residual(const Sim3& b_from_a,
                                                      const LandmarkMatches& matches,
                                                      std::size_t index);

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

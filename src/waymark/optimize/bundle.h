// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "waymark/solver/bundle_problem.h"

namespace waymark {

struct BundleResult {
  std::vector<std::uint8_t> is_outlier;  ///< Per observation, judged with the result.
  double initial_cost = 0.0;  ///< Half the robust sum over all observations before the first round.
  double final_cost = 0.0;    ///< That of the last round over its observations, after it.
  int num_iterations = 0;     ///< Of all rounds.
  /// With motion, median lengths of all residuals before the first round and at the end, outliers
  /// included.
  double initial_median_px = 0.0, final_median_px = 0.0;
  double noise_px = 0.0;  ///< Standard deviation of a residual's component, of what is no outlier.
};

/// Bundle adjustment: moves the free poses and all points to minimise the robust sum of
/// |W * (normalize(cam_from_rig * rig_from_world * point) - bearing)|^2, in pixels of each
/// feature's level, and of ((1 / |point_in_cam| - inverse_range) / inverse_range_sigma)^2 where
/// there is a range (a range is robust on its own and does not make an outlier). Writes poses,
/// points and the calibration, where that is unknown, back.
///
/// Gauge: the caller fixes poses; one where stereo or ranges give the scale, one or two in mono.
/// With fewer than the problem has free directions the result is one of the equivalent ones, near
/// the start, because the damping of Levenberg-Marquardt bounds motion along them. Points without
/// observations stay; a point seen once moves onto its ray at about its distance. Observations that
/// are not finite, or more than 90 degrees off, are outliers and pull nothing. Repeatable by bits.
BundleResult adjust_bundle(BundleProblem& problem, const BundleOptions& options);

}  // namespace waymark

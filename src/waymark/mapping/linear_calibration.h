// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Numbers beside those of the projection that move what the observations of a rig measure: when
/// rows were read, what a depth image is off by. Few, and linear near enough.
struct LinearCalibration {
  /// Derivatives of the pixel of an observation's level, 2 per number and observation, number by
  /// number; empty: they move none.
  std::vector<float> level_pixel_by = {};
  /// The same of the inverse range, 1 per number and observation, in 1/m; empty: they move none.
  std::vector<float> inverse_range_by = {};
  Eigen::VectorXd given;        ///< Around which the prior is.
  Eigen::VectorXd prior_sigma;  ///< Its standard deviations; 0 of what is held.
  Eigen::VectorXd value;        ///< With which the observations are measured.
  Eigen::VectorXd sigma = {};   ///< Standard deviations of the estimate.
};

/// Adjusts a problem together with the numbers, whose value and sigma become the estimate. The
/// change of the value, by which the caller is to measure the observations anew; nothing where
/// there is no estimate.
std::optional<Eigen::VectorXd> adjust_linear(const Rig& rig,
                                             BundleProblem& problem,
                                             LinearCalibration& calibration);

/// Whether an adjustment could find numbers that are so many standard deviations from what was
/// given and not those in use: by what one step promises, with none taken.
bool may_be_contradicted(const Rig& rig,
                         BundleProblem& problem,
                         const LinearCalibration& calibration,
                         double min_sigmas);

}  // namespace waymark

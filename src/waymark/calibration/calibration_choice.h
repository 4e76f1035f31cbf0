// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/solver/bundle_problem.h"

namespace waymark {

/// Which numbers of a calibration images are asked for.
enum class FreeParameters {
  kReadout,  ///< That alone, which few images tell.
  kLikely,   ///< All but centres and tangential distortion, which take up errors of other kinds.
  kAll,
};

/// What images tell of a calibration at a change from what was given.
struct CalibrationCost {
  Eigen::VectorXd at;            ///< The change.
  CalibrationEvidence evidence;  ///< There, all else following.
  double variance = 1.0;         ///< Of residuals, px^2, that its cost is to be divided by.
};

/// What is known of a calibration before images tell of it.
struct CalibrationPrior {
  std::vector<double> sigmas;   ///< Standard deviations of changes; 0 of what is held.
  Eigen::MatrixXd information;  ///< What follows from them, and from what is alike.
};

/// What images and a prior tell together.
struct CalibrationPosterior {
  CalibrationPrior prior;
  Eigen::VectorXd change;  ///< The most likely one, from what was given.
  // Where what images tell has systematic errors:
  Eigen::VectorXd sigma;      ///< Standard deviations of the change.
  double log_evidence = 0.0;  ///< Of the prior, over that of no change.
};

/// By how much the images are likelier, in nats, with what they and a prior tell than with another
/// change: each part of the way with what the other parts tell.
double predicted_gain(const CalibrationCost& cost,
                      const CalibrationPosterior& posterior,
                      const Eigen::VectorXd& other);

/// By how much what images and a prior tell is likelier than another change, in nats.
double gain(const CalibrationCost& cost,
            const CalibrationPosterior& posterior,
            const Eigen::VectorXd& other);

/// The variance of residuals by what the parts of the way contradict each other at that: more than
/// their noise, since errors that last count only once.
double variance_between_parts(const CalibrationCost& cost, const CalibrationPosterior& posterior);

/// Of the priors that say how calibrations err, the one that makes the images likeliest, and what
/// follows from it. A calibration is as good as usual or, which is rarer, wrong by more, in its
/// focal lengths, its distortion and its turns each for itself; rarely are bearings of a pair off
/// smoothly over the image, now and then depths are, or a shutter rolls that is not told of. Among
/// explanations that fit alike the one wins that needs the smaller and fewer errors (MacKay, 1992,
/// "Bayesian interpolation").
CalibrationPosterior choose_prior(const CalibrationParameters& parameters,
                                  const CalibrationCost& cost,
                                  FreeParameters free);

/// The widest of these priors.
CalibrationPrior widest_prior(const CalibrationParameters& parameters, FreeParameters free);

}  // namespace waymark

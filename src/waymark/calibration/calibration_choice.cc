// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/calibration_choice.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace waymark {
namespace {

/// Standard deviations of a group, relative to the usual ones, and how likely a calibration has
/// them.
struct Spread {
  double factor;
  double probability;
};
constexpr std::array<Spread, 3> kSpreads = {{{1.0, 1.0}, {5.0, 1e-5}, {25.0, 1e-6}}};

/// In place of no systematic error, so that all have one.
constexpr double kNone = 1e-7;

/// A bound is wider by so much for the rounding of what it bounds.
constexpr double kRounding = 1.0 + 1e-6;

/// Of pairs so many have bearings that are off smoothly over the image, in each direction.
constexpr double kBearingErrorProbability = 0.3;
/// Depths have an offset that nobody told of, or a shutter rolls: most do, but not those of the
/// cameras that people calibrate.
constexpr double kSensorErrorProbability = 0.1;

/// No camera needs longer for its rows.
constexpr double kMaxReadoutMs = 100.0;

/// An explanation: which spread each of the three groups has, and which of the other errors
/// there are.
struct Spreads {
  std::array<std::size_t, 3> groups = {};
  bool is_off_along = false;
  bool is_off_across = false;
  bool has_readout = false;
  bool has_depth_offset = false;
};

constexpr std::size_t kWidest = kSpreads.size() - 1;

std::vector<Spreads> all_spreads(const CalibrationParameters& parameters, FreeParameters free) {
  if (free == FreeParameters::kReadout) return {{}, {.has_readout = true}};
  const bool is_pair = parameters.find(CalibrationGroup::kAlong).has_value();
  std::vector<Spreads> all;
  for (std::size_t focal = 0; focal < kSpreads.size(); ++focal) {
    for (std::size_t radial = 0; radial < kSpreads.size(); ++radial) {
      for (std::size_t turn = 0; turn < (is_pair ? kSpreads.size() : 1); ++turn) {
        for (unsigned others = 0; others < (is_pair ? 8 : 4); ++others) {
          const bool has_first = (others & 1) != 0, has_second = (others & 2) != 0;
          const std::array<std::size_t, 3> groups = {focal, radial, turn};
          // Pairs have no depth image.
          all.push_back(is_pair ? Spreads{groups, has_first, has_second, (others & 4) != 0, false}
                                : Spreads{groups, false, false, has_first, has_second});
        }
      }
    }
  }
  return all;
}

double factor_of(CalibrationGroup group, const Spreads& spreads) {
  switch (group) {
    case CalibrationGroup::kFocalLength:
      return kSpreads[spreads.groups[0]].factor;
    case CalibrationGroup::kRadial:
      return kSpreads[spreads.groups[1]].factor;
    case CalibrationGroup::kExtrinsics:
      return kSpreads[spreads.groups[2]].factor;
    case CalibrationGroup::kAlong:
      return spreads.is_off_along ? 1.0 : 0.0;
    case CalibrationGroup::kAcross:
      return spreads.is_off_across ? 1.0 : 0.0;
    case CalibrationGroup::kReadout:
      return spreads.has_readout ? 1.0 : 0.0;
    case CalibrationGroup::kDepthOffset:
      return spreads.has_depth_offset ? 1.0 : 0.0;
    default:
      return 1.0;
  }
}

/// Whether images are asked for a number.
bool is_free(const CalibrationParameter& parameter, FreeParameters free) {
  if (free == FreeParameters::kReadout) return parameter.group == CalibrationGroup::kReadout;
  return free == FreeParameters::kAll || (parameter.group != CalibrationGroup::kCentre &&
                                          parameter.group != CalibrationGroup::kTangential);
}

/// That a calibration errs so.
double log_probability(const CalibrationParameters& parameters, const Spreads& spreads) {
  const auto is_told = [&](CalibrationGroup group) {
    const auto at = parameters.find(group);
    return at && parameters.list()[*at].given != 0.0;
  };
  double sum = 0.0;
  sum +=
      (int{spreads.is_off_along} + int{spreads.is_off_across}) * std::log(kBearingErrorProbability);
  const bool has_untold_offset =
      spreads.has_depth_offset && !is_told(CalibrationGroup::kDepthOffset);
  const bool has_untold_readout = spreads.has_readout && !is_told(CalibrationGroup::kReadout);
  sum += (int{has_untold_offset} + int{has_untold_readout}) * std::log(kSensorErrorProbability);
  for (const std::size_t spread : spreads.groups) sum += std::log(kSpreads[spread].probability);
  return sum;
}

CalibrationPrior prior_of(const CalibrationParameters& parameters,
                          const Spreads& spreads,
                          FreeParameters free) {
  CalibrationPrior prior;
  for (const CalibrationParameter& parameter : parameters.list()) {
    const double factor = is_free(parameter, free) ? factor_of(parameter.group, spreads) : 0.0;
    prior.sigmas.push_back(factor * parameter.prior_sigma);
  }
  prior.information = parameters.prior_information(prior.sigmas);
  return prior;
}

/// Rows are read from the top down, unless it is told otherwise.
bool has_possible_readout(const CalibrationParameters& parameters, const Eigen::VectorXd& change) {
  const auto at = parameters.find(CalibrationGroup::kReadout);
  if (!at) return true;
  const double given = parameters.list()[*at].given;
  const double readout = given + change[static_cast<Eigen::Index>(*at)];
  return std::abs(readout) < kMaxReadoutMs && (given < 0.0 ? readout <= 0.0 : readout >= 0.0);
}

double log_determinant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

/// Second derivative of the cost by the change and its pull from no change, of images alone.
CalibrationTold at_given(const CalibrationCost& cost, const CalibrationTold& told) {
  return {told.information / cost.variance,
          (told.gradient - told.information * cost.at) / cost.variance};
}

/// The same where what images tell has systematic errors: of a covariance V^-1 + S in place of
/// V^-1, with V their information.
CalibrationTold with_systematic_errors(const CalibrationParameters& parameters,
                                       const CalibrationTold& told) {
  Eigen::MatrixXd sum = told.information;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::max(parameters.list()[i].systematic_sigma, kNone);
    sum(at, at) += 1.0 / (sigma * sigma);
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(sum);
  return {told.information - told.information * factor.solve(told.information),
          told.gradient - told.information * factor.solve(told.gradient)};
}

/// By how much images are likelier with the likeliest change than with none. factor: of what they
/// tell and a prior.
double gain_of(const CalibrationTold& told, const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 0.5 * told.gradient.dot(factor.solve(told.gradient));
}

/// The most likely change.
Eigen::VectorXd change_of(const CalibrationTold& told, const CalibrationPrior& prior) {
  return -(told.information + prior.information).llt().solve(told.gradient);
}

/// All but the change and the standard deviations. told: with systematic errors.
CalibrationPosterior posterior(const CalibrationTold& told, CalibrationPrior prior) {
  CalibrationPosterior result;
  result.prior = std::move(prior);
  const Eigen::LLT<Eigen::MatrixXd> factor(told.information + result.prior.information);
  const Eigen::LLT<Eigen::MatrixXd> of_prior(result.prior.information);
  result.log_evidence =
      gain_of(told, factor) + 0.5 * (log_determinant(of_prior) - log_determinant(factor));
  return result;
}

}  // namespace

double predicted_gain(const CalibrationCost& cost,
                      const CalibrationPosterior& posterior,
                      const Eigen::VectorXd& other) {
  const CalibrationTold whole = at_given(cost, cost.evidence.whole);
  double gain = 0.0;
  for (const CalibrationTold& told : cost.evidence.parts) {
    const CalibrationTold part = at_given(cost, told);
    const Eigen::MatrixXd information =
        whole.information - part.information + posterior.prior.information;
    const Eigen::VectorXd change = information.llt().solve(part.gradient - whole.gradient);
    const auto cost_of = [&](const Eigen::VectorXd& x) {
      return x.dot(part.gradient + 0.5 * (part.information * x));
    };
    gain += cost_of(other) - cost_of(change);
  }
  return gain;
}

double gain(const CalibrationCost& cost,
            const CalibrationPosterior& posterior,
            const Eigen::VectorXd& other) {
  const Eigen::VectorXd off = other - posterior.change;
  const Eigen::MatrixXd information =
      cost.evidence.whole.information / cost.variance + posterior.prior.information;
  return 0.5 * off.dot(information * off);
}

double variance_between_parts(const CalibrationCost& cost, const CalibrationPosterior& posterior) {
  const CalibrationEvidence& evidence = cost.evidence;
  const Eigen::LLT<Eigen::MatrixXd> information(evidence.whole.information +
                                                cost.variance * posterior.prior.information);
  const double expected = information.solve(evidence.whole.information).trace();
  const double seen = information.solve(evidence.scatter_after(posterior.change - cost.at)).trace();
  return expected > 0.0 ? seen / expected : 0.0;
}

CalibrationPrior widest_prior(const CalibrationParameters& parameters, FreeParameters free) {
  return prior_of(parameters, {{kWidest, kWidest, kWidest}, true, true, true, true}, free);
}

CalibrationPosterior choose_prior(const CalibrationParameters& parameters,
                                  const CalibrationCost& cost,
                                  FreeParameters free) {
  const CalibrationTold told = at_given(cost, cost.evidence.whole);
  const CalibrationTold with_errors = with_systematic_errors(parameters, told);
  // No prior gains more than one that is at least as wide in everything, and none is likelier than
  // by what it gains: most need no equations to be ruled out.
  const Eigen::LLT<Eigen::MatrixXd> of_widest(with_errors.information +
                                              widest_prior(parameters, free).information);
  const double most = kRounding * gain_of(with_errors, of_widest);
  CalibrationPosterior best;
  best.log_evidence = -HUGE_VAL;
  for (const Spreads& spreads : all_spreads(parameters, free)) {
    const double log_probable = log_probability(parameters, spreads);
    if (most + log_probable <= best.log_evidence) continue;
    CalibrationPosterior one = posterior(with_errors, prior_of(parameters, spreads, free));
    one.log_evidence += log_probable;
    if (one.log_evidence <= best.log_evidence) continue;
    one.change = change_of(told, one.prior);
    if (spreads.has_readout && !has_possible_readout(parameters, one.change)) continue;
    best = std::move(one);
  }
  const auto size = best.change.size();
  const Eigen::LLT<Eigen::MatrixXd> factor(with_errors.information + best.prior.information);
  best.sigma = factor.solve(Eigen::MatrixXd::Identity(size, size)).diagonal().cwiseSqrt();
  return best;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/calibration_choice.h"

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
constexpr std::array<Spread, 3> kSpreads = {{{1.0, 1.0}, {5.0, 1e-3}, {25.0, 1e-4}}};

/// In place of no systematic error, so that all have one.
constexpr double kNone = 1e-7;

/// A pair whose bearings are off smoothly over the image is as likely.
constexpr double kBearingErrorProbability = 1e-3;

/// Which spread each of the three groups has.
struct Spreads {
  std::array<std::size_t, 3> groups = {};
  bool has_bearing_error = false;
};

/// Whether images are asked for a number: centres and tangential distortion take up errors of other
/// kinds, such as those of a rolling shutter, and calibrations hardly err in them.
bool is_likely_wrong(const CalibrationParameter& parameter) {
  return parameter.group != CalibrationGroup::kCentre &&
         parameter.group != CalibrationGroup::kTangential;
}

double factor_of(CalibrationGroup group, const Spreads& spreads) {
  switch (group) {
    case CalibrationGroup::kFocalLength:
      return kSpreads[spreads.groups[0]].factor;
    case CalibrationGroup::kRadial:
      return kSpreads[spreads.groups[1]].factor;
    case CalibrationGroup::kExtrinsics:
      return kSpreads[spreads.groups[2]].factor;
    case CalibrationGroup::kBearing:
      return spreads.has_bearing_error ? 1.0 : 0.0;
    default:
      return 1.0;
  }
}

std::vector<double> sigmas_of(const CalibrationParameters& parameters,
                              const Spreads& spreads,
                              bool is_all_free) {
  std::vector<double> sigmas;
  for (const CalibrationParameter& parameter : parameters.list()) {
    const bool is_free = is_all_free || is_likely_wrong(parameter);
    sigmas.push_back(is_free ? factor_of(parameter.group, spreads) * parameter.prior_sigma : 0.0);
  }
  return sigmas;
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

/// With what images tell, and the same with systematic errors, which says how sure that is.
CalibrationPosterior posterior(const CalibrationParameters& parameters,
                               const CalibrationTold& told,
                               const CalibrationTold& told_with_errors,
                               std::vector<double> prior_sigmas) {
  CalibrationPosterior result;
  result.prior_information = parameters.prior_information(prior_sigmas);
  result.prior_sigmas = std::move(prior_sigmas);
  result.change = -(told.information + result.prior_information).llt().solve(told.gradient);
  const Eigen::LLT<Eigen::MatrixXd> factor(told_with_errors.information + result.prior_information);
  const Eigen::LLT<Eigen::MatrixXd> of_prior(result.prior_information);
  const auto size = result.change.size();
  result.sigma = factor.solve(Eigen::MatrixXd::Identity(size, size)).diagonal().cwiseSqrt();
  const Eigen::VectorXd& gradient = told_with_errors.gradient;
  result.gain = 0.5 * gradient.dot(factor.solve(gradient));
  result.log_evidence = result.gain + 0.5 * (log_determinant(of_prior) - log_determinant(factor));
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
        whole.information - part.information + posterior.prior_information;
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
      cost.evidence.whole.information / cost.variance + posterior.prior_information;
  return 0.5 * off.dot(information * off);
}

double variance_between_parts(const CalibrationCost& cost, const CalibrationPosterior& posterior) {
  const CalibrationEvidence& evidence = cost.evidence;
  const Eigen::LLT<Eigen::MatrixXd> information(evidence.whole.information +
                                                cost.variance * posterior.prior_information);
  const double expected = information.solve(evidence.whole.information).trace();
  const double seen = information.solve(evidence.scatter_after(posterior.change - cost.at)).trace();
  return expected > 0.0 ? seen / expected : 0.0;
}

Eigen::MatrixXd widest_prior(const CalibrationParameters& parameters, bool is_all_free) {
  constexpr std::size_t kWidest = kSpreads.size() - 1;
  return parameters.prior_information(
      sigmas_of(parameters, {{kWidest, kWidest, kWidest}, true}, is_all_free));
}

CalibrationPosterior choose_prior(const CalibrationParameters& parameters,
                                  const CalibrationCost& cost,
                                  bool is_all_free) {
  const CalibrationTold told = at_given(cost, cost.evidence.whole);
  const CalibrationTold with_errors = with_systematic_errors(parameters, told);
  CalibrationPosterior best;
  best.log_evidence = -HUGE_VAL;
  constexpr std::size_t kNumSpreads = kSpreads.size();
  for (std::size_t i = 0; i < 2 * kNumSpreads * kNumSpreads * kNumSpreads; ++i) {
    const std::size_t j = i / 2;
    const Spreads spreads{
        {j % kNumSpreads, j / kNumSpreads % kNumSpreads, j / kNumSpreads / kNumSpreads},
        i % 2 == 1};
    CalibrationPosterior one =
        posterior(parameters, told, with_errors, sigmas_of(parameters, spreads, is_all_free));
    if (spreads.has_bearing_error) one.log_evidence += std::log(kBearingErrorProbability);
    for (const std::size_t spread : spreads.groups) {
      one.log_evidence += std::log(kSpreads[spread].probability);
    }
    if (one.log_evidence > best.log_evidence) best = std::move(one);
  }
  return best;
}

}  // namespace waymark

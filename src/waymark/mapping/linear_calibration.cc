// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/linear_calibration.h"

#include <Eigen/Cholesky>
#include <utility>

namespace waymark {
namespace {

/// In place of 0, so that what is held is a number like the others.
constexpr double kHeld = 1e-9;

/// What a step from where an adjustment ended would give.
struct Promise {
  Eigen::VectorXd step;
  /// As the spread of what parts of the way tell has it, where that is more than noise explains.
  Eigen::VectorXd sigma;
  Eigen::VectorXd sigma_by_noise;
};

Promise promise_of(const BundleCalibration& found, double noise_px) {
  const CalibrationEvidence& evidence = found.evidence;
  const Eigen::LDLT<Eigen::MatrixXd> information(evidence.whole.information +
                                                 found.prior_information);
  const Eigen::VectorXd by_prior = found.prior_information * (found.change - found.prior_change);
  Promise promise{-information.solve(evidence.whole.gradient + by_prior), {}, {}};
  const auto size = found.change.size();
  const Eigen::MatrixXd covariance = information.solve(Eigen::MatrixXd::Identity(size, size));
  promise.sigma_by_noise = noise_px * covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd by_spread = covariance * evidence.scatter_after(promise.step) * covariance;
  promise.sigma = by_spread.diagonal().cwiseSqrt().cwiseMax(promise.sigma_by_noise);
  return promise;
}

BundleCalibration unknowns(const Rig& rig,
                           const LinearCalibration& linear,
                           std::size_t num_observations) {
  const auto count = static_cast<std::size_t>(linear.value.size());
  BundleCalibration calibration;
  calibration.rig = &rig;
  calibration.blocks.assign(rig.cameras.size(), {0, count, false});
  const bool has_pixels = !linear.level_pixel_by.empty();
  for (std::size_t i = 0; i < num_observations; ++i) {
    calibration.first_derivative.push_back(has_pixels ? 2 * count * i : 0);
  }
  calibration.level_pixel_by_intrinsics = linear.level_pixel_by;
  if (!has_pixels) calibration.level_pixel_by_intrinsics.assign(2 * count, 0.0f);
  calibration.inverse_range_by_intrinsics = linear.inverse_range_by;
  calibration.prior_information =
      linear.prior_sigma.cwiseMax(kHeld).cwiseAbs2().cwiseInverse().asDiagonal();
  calibration.prior_change = linear.given - linear.value;
  calibration.change.setZero(linear.value.size());
  return calibration;
}

}  // namespace

bool may_be_contradicted(const Rig& rig,
                         BundleProblem& problem,
                         const LinearCalibration& calibration,
                         double min_sigmas) {
  problem.calibration = unknowns(rig, calibration, problem.observations.size());
  const BundleResult result =
      adjust_bundle(problem, {.num_rounds = 1, .max_iterations_per_round = 0});
  const BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.is_empty()) return false;
  const Promise promise = promise_of(found, result.noise_px);
  const Eigen::ArrayXd off = promise.step + calibration.value - calibration.given;
  // Parts of the way contradict each other in what is wrong, too, before it is mended.
  const Eigen::ArrayXd sigma = promise.sigma_by_noise;
  return (off.abs() > min_sigmas * sigma && promise.step.array().abs() > sigma).any();
}

std::optional<Eigen::VectorXd> adjust_linear(const Rig& rig,
                                             BundleProblem& problem,
                                             LinearCalibration& calibration) {
  problem.calibration = unknowns(rig, calibration, problem.observations.size());
  const BundleResult result =
      adjust_bundle(problem, {.num_rounds = 2, .max_iterations_per_round = 4});
  const BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.is_empty()) return std::nullopt;
  calibration.value += found.change;
  calibration.sigma = promise_of(found, result.noise_px).sigma;
  return found.change;
}

}  // namespace waymark

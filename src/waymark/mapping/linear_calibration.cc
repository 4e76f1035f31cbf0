// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/linear_calibration.h"

#include <Eigen/Cholesky>
#include <utility>

namespace waymark {
namespace {

/// In place of 0, so that what is held is a number like the others.
constexpr double kHeld = 1e-9;

/// As the spread of what parts of the way tell has it, where that is more than noise explains.
Eigen::VectorXd standard_deviations(const CalibrationEvidence& evidence, double noise_px) {
  const Eigen::MatrixXd covariance = evidence.information.ldlt().solve(
      Eigen::MatrixXd::Identity(evidence.information.rows(), evidence.information.cols()));
  const Eigen::VectorXd by_noise = noise_px * noise_px * covariance.diagonal();
  const Eigen::MatrixXd by_spread = covariance * evidence.scatter * covariance;
  return by_noise.cwiseMax(by_spread.diagonal()).cwiseSqrt();
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

std::optional<Eigen::VectorXd> adjust_linear(const Rig& rig,
                                             BundleProblem& problem,
                                             LinearCalibration& calibration) {
  problem.calibration = unknowns(rig, calibration, problem.observations.size());
  const BundleResult result =
      adjust_bundle(problem, {.num_rounds = 2, .max_iterations_per_round = 4});
  const BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.information.size() == 0) return std::nullopt;
  calibration.value += found.change;
  calibration.sigma = standard_deviations(found.evidence, result.noise_px);
  return found.change;
}

}  // namespace waymark

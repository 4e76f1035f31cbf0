// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/bundle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/solver/residual.h"
#include "waymark/solver/schur_solver.h"

namespace waymark {
namespace {

/// Wide enough to be nearly as efficient as least squares on what is Gaussian.
constexpr double kHuberSigmas = 2.0;
/// Corners are not located better than this, whatever few residuals say.
constexpr double kMinNoisePx = 0.15;
/// Of a component of a residual where none can be measured.
constexpr double kAssumedNoisePx = 1.0;

void check(const BundleProblem& problem) {
  WAYMARK_CHECK(problem.rigs.size() == problem.rig_from_world.size());
  WAYMARK_CHECK(problem.is_pose_fixed.size() == problem.rig_from_world.size());
  WAYMARK_CHECK(!problem.calibration || !problem.motion);
  if (problem.calibration) {
    WAYMARK_CHECK(problem.calibration->first_derivative.size() == problem.observations.size());
  }
  std::uint32_t last_point = 0;
  for (const BundleObservation& observation : problem.observations) {
    WAYMARK_CHECK(observation.pose < problem.rig_from_world.size());
    WAYMARK_CHECK(observation.point < problem.points.size());
    WAYMARK_CHECK(observation.camera < problem.rigs[observation.pose]->cameras.size());
    WAYMARK_CHECK(observation.point >= last_point);
    last_point = observation.point;
  }
}

/// Squared length of the residual of the bearing, px^2; not finite where an input is not.
double squared_residual(const BundleProblem& problem, std::size_t index) {
  const BundleObservation& observation = problem.observations[index];
  const Rig& rig = *problem.rigs[observation.pose];
  const BundleCalibration* const calibration = problem.calibration_of(observation.pose);
  const Rigid3 cam_from_rig =
      calibration ? calibration->cam_from_rig(observation.camera, calibration->change)
                  : rig.cameras[observation.camera].cam_from_rig;
  const Rigid3& rig_from_world = problem.rig_from_world[observation.pose];
  const InverseRangePoint seen =
      in_inverse_range(cam_from_rig * (rig_from_world * problem.points[observation.point]));
  Eigen::Vector2d residual =
      bearing_residual(seen, observation.bearing, observation.level_pixel_from_bearing);
  if (calibration) {
    residual += calibration->pixel_shift(index, observation.camera, calibration->change);
  }
  const double squared = residual.squaredNorm();
  if (!std::isfinite(squared)) return squared;
  return is_ahead(seen, observation.bearing) ? squared : kGrossSquaredResidual;
}

/// What observations are worth where the problem has got to.
struct JudgedObservations {
  std::vector<double> squared_residuals;
  std::vector<std::uint8_t> is_used;
};

/// Standard deviation of a residual component as the used observations show it: the median length
/// of Gaussian residuals in the plane is 1.177 sigma. Robust as a median is, so that the loss
/// narrows on what is noise and leaves out what is wrong.
std::optional<double> measured_noise_px(const JudgedObservations& judged) {
  std::vector<double> squared;
  squared.reserve(judged.squared_residuals.size());
  for (std::size_t i = 0; i < judged.is_used.size(); ++i) {
    if (judged.is_used[i]) squared.push_back(judged.squared_residuals[i]);
  }
  if (squared.empty()) return std::nullopt;
  return std::sqrt(median(squared)) / 1.177;
}

double median_residual_px(const JudgedObservations& judged) {
  std::vector<double> squared = judged.squared_residuals;
  return squared.empty() ? 0.0 : std::sqrt(median(squared));
}

/// Options of a round: the loss as narrow as the noise allows.
BundleOptions narrowed(const BundleOptions& options, const JudgedObservations& judged) {
  BundleOptions result = options;
  if (const auto noise_px = measured_noise_px(judged)) {
    result.huber_px = std::min(kHuberSigmas * std::max(*noise_px, kMinNoisePx), options.huber_px);
  }
  return result;
}

bool has_usable_range(const BundleObservation& observation) {
  return !(observation.inverse_range_sigma > 0.0f) ||
         (std::isfinite(observation.inverse_range) &&
          std::isfinite(observation.inverse_range_sigma));
}

}  // namespace

BundleResult adjust_bundle(BundleProblem& problem, const BundleOptions& options) {
  check(problem);
  const std::size_t num_observations = problem.observations.size();
  JudgedObservations judged{std::vector<double>(num_observations),
                            std::vector<std::uint8_t>(num_observations)};
  const auto judge = [&](double max_squared_residual) {
    for (std::size_t i = 0; i < num_observations; ++i) {
      judged.squared_residuals[i] = squared_residual(problem, i);
      judged.is_used[i] = judged.squared_residuals[i] <= max_squared_residual &&
                          has_usable_range(problem.observations[i]);
    }
  };
  judge(std::numeric_limits<double>::max());
  BundleResult result;
  if (problem.motion) result.initial_median_px = median_residual_px(judged);
  for (int round = 0; round < options.num_rounds; ++round) {
    BundleOptions round_options = narrowed(options, judged);
    if (problem.motion) {
      problem.motion->noise_px =
          std::max(measured_noise_px(judged).value_or(kAssumedNoisePx), kMinNoisePx);
    }
    round_options.with_evidence = round + 1 == options.num_rounds;
    const BundleRound done = minimize_with_schur(problem, judged.is_used, round_options);
    if (round == 0) result.initial_cost = done.initial_cost;
    result.final_cost = done.final_cost;
    result.num_iterations += done.num_iterations;
    judge(options.gate_px * options.gate_px);
  }
  if (problem.motion) result.final_median_px = median_residual_px(judged);
  result.noise_px = measured_noise_px(judged).value_or(0.0);
  result.is_outlier.resize(num_observations);
  for (std::size_t i = 0; i < num_observations; ++i) {
    result.is_outlier[i] = !judged.is_used[i];
  }
  return result;
}

}  // namespace waymark

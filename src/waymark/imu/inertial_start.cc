// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_start.h"

#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/imu/inertial_refinement.h"
#include "waymark/imu/linear_start.h"
#include "waymark/imu/rotation_start.h"
#include "waymark/imu/weak_scale.h"

namespace waymark {
namespace {

/// In which samples are cut and integrated anew with the time shift and the biases reached.
constexpr int kMaxCuts = 5;
/// Smaller changes of the time shift are exact to first order.
constexpr double kStillShift = 3e-4;
/// Standard deviation of the logarithm of a scale whose posterior is not taken to be normal.
constexpr double kWeakScale = 0.1;

struct StartProblem {
  const ImuSamples& samples;
  std::span<const VisionPose> poses;
  const ImuCalibration& calibration;
  const ImuNoise& noise;
  const InertialStartOptions& options;
};

/// Nothing in it where samples are missing.
PreintegrationChain cut_chain(const StartProblem& problem,
                              double time_shift_s,
                              std::span<const ImuBiases> biases) {
  PreintegrationChain chain;
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * time_shift_s));
  for (std::size_t i = 0; i + 1 < problem.poses.size(); ++i) {
    ImuSpan span = problem.samples.between(problem.poses[i].timestamp_ns + shift_ns,
                                           problem.poses[i + 1].timestamp_ns + shift_ns);
    chain.emplace_back();
    if (span.coverage != ImuCoverage::kWhole) continue;
    chain.back().emplace(std::move(span.samples), problem.noise, biases[i]);
  }
  return chain;
}

bool is_empty(const PreintegrationChain& chain) {
  for (const auto& one : chain) {
    if (one) return false;
  }
  return true;
}

InertialBelief belief_before(const StartProblem& problem, const RotationStart& rotation) {
  const InertialStartOptions& options = problem.options;
  const auto& told = problem.calibration.imu_from_rig;
  InertialBelief belief;
  belief.log_scale = options.log_scale;
  belief.log_scale_sigma = options.log_scale_sigma;
  belief.imu_from_rig = told.value_or(Rigid3(rotation.imu_from_rig, Eigen::Vector3d::Zero()));
  belief.rotation_sigma = told ? options.told_rotation_sigma : M_PI;
  belief.lever_arm_sigma = told ? options.told_lever_arm_sigma : options.lever_arm_sigma;
  belief.time_shift_sigma_s = problem.calibration.time_shift_s ? options.told_time_shift_sigma_s
                                                               : options.time_shift_sigma_s;
  return belief;
}

/// What the squared error is in the mean: measured numbers and beliefs without what is fitted.
double degrees_of_freedom(const PreintegrationChain& chain) {
  const double num_states = static_cast<double>(chain.size() + 1);
  double freedom = 8.0 - 10.0 + 6.0 - (15.0 - 6.0) * num_states;
  for (const auto& one : chain) freedom += one ? 15.0 : 6.0;
  return freedom;
}

/// Refines, and cuts and integrates anew until time shift and biases stay. The chain is left as it
/// was refined with, and the time shift as it was cut at.
void refine_with_cuts(const StartProblem& problem,
                      double& time_shift_s,
                      PreintegrationChain& chain,
                      InertialBelief& belief,
                      InertialRefinement& refined) {
  std::vector<ImuBiases> biases(problem.poses.size());
  const double told_shift = problem.calibration.time_shift_s.value_or(0.0);
  for (int cut = 0; cut < kMaxCuts; ++cut) {
    belief.time_shift_change_s = told_shift - time_shift_s;
    refined = refine_inertial_start(
        problem.poses, chain, std::move(refined.unknowns), belief, problem.options);
    InertialSetup& setup = refined.unknowns.setup;
    for (std::size_t i = 0; i < biases.size(); ++i) biases[i] = refined.unknowns.states[i].biases;
    if (std::abs(setup.time_shift_change_s) > kStillShift) {
      const double next_shift = time_shift_s + setup.time_shift_change_s;
      PreintegrationChain next = cut_chain(problem, next_shift, biases);
      if (is_empty(next)) return;
      chain = std::move(next);
      time_shift_s = next_shift;
      setup.time_shift_change_s = 0.0;
      continue;
    }
    bool is_integrated_anew = false;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      if (chain[i] && chain[i]->reintegrate_if_far(biases[i])) is_integrated_anew = true;
    }
    if (!is_integrated_anew) return;
  }
}

}  // namespace

std::optional<InertialStart> start_inertial(const ImuSamples& samples,
                                            std::span<const VisionPose> poses,
                                            const ImuCalibration& calibration,
                                            const ImuNoise& noise,
                                            const InertialStartOptions& options) {
  for (std::size_t i = 1; i < poses.size(); ++i) {
    WAYMARK_CHECK(poses[i - 1].timestamp_ns < poses[i].timestamp_ns);
  }
  const StartProblem problem{samples, poses, calibration, noise, options};
  const auto rotation = rotation_start(samples, poses, calibration, noise, options);
  if (!rotation) return std::nullopt;
  InertialStart start;
  start.time_shift_s = rotation->time_shift_s;
  std::vector<ImuBiases> biases(poses.size(), {rotation->gyroscope_bias, Eigen::Vector3d::Zero()});
  PreintegrationChain chain = cut_chain(problem, start.time_shift_s, biases);
  if (is_empty(chain)) return std::nullopt;
  InertialBelief belief = belief_before(problem, *rotation);
  InertialRefinement refined;
  refined.unknowns =
      linear_start(poses, chain, belief.imu_from_rig, belief.lever_arm_sigma, options);
  for (InertialState& state : refined.unknowns.states) {
    state.biases.gyroscope = rotation->gyroscope_bias;
  }
  refine_with_cuts(problem, start.time_shift_s, chain, belief, refined);
  if (std::sqrt(refined.covariance(2, 2)) > kWeakScale) {
    refined = refine_weak_scale(poses, chain, std::move(refined.unknowns), belief, options);
  }
  if (!refined.covariance.allFinite()) return std::nullopt;
  start.time_shift_s += std::exchange(refined.unknowns.setup.time_shift_change_s, 0.0);
  start.setup = refined.unknowns.setup;
  start.states = std::move(refined.unknowns.states);
  start.covariance = refined.covariance;
  start.squared_error = refined.squared_error;
  start.degrees_of_freedom = degrees_of_freedom(chain);
  return start;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_start.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/imu/start_steps.h"

namespace waymark {
namespace {

/// In which samples are cut and integrated anew with the time shift and the biases reached.
constexpr int kMaxCuts = 5;
/// Smaller changes of the time shift are exact to first order.
constexpr double kStillShift = 3e-4;
/// A scale whose logarithm has a larger standard deviation is not told.
constexpr double kWeakScale = 0.1;

PreintegrationChain cut_chain(const StartProblem& problem,
                              double time_shift_s,
                              std::span<const InertialState> states) {
  PreintegrationChain chain{time_shift_s, {}};
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * time_shift_s));
  for (std::size_t i = 0; i + 1 < problem.poses.size(); ++i) {
    std::vector<ImuSample> samples = problem.samples.between(
        problem.poses[i].timestamp_ns + shift_ns, problem.poses[i + 1].timestamp_ns + shift_ns);
    auto& interval = chain.intervals.emplace_back();
    if (!samples.empty()) interval.emplace(std::move(samples), problem.noise, states[i].biases);
  }
  return chain;
}

/// How the rig turned in an interval by the gyroscope: rig_end_from_rig_begin.
Eigen::Quaterniond turn_of_rig(const Preintegration& interval,
                               const Eigen::Quaterniond& imu_from_rig) {
  return imu_from_rig.conjugate() * interval.delta().rotation.conjugate() * imu_from_rig;
}

/// Where refinement begins: gravity is what the mean force holds up, velocities are those of the
/// poses at the scale believed; poses that are not seen are turned as the gyroscope tells.
InertialUnknowns first_guess(const StartProblem& problem,
                             const PreintegrationChain& chain,
                             const RotationStart& rotation) {
  InertialUnknowns unknowns;
  InertialSetup& setup = unknowns.setup;
  setup.log_scale = problem.options.log_scale;
  setup.imu_from_rig = {rotation.imu_from_rig,
                        -(rotation.imu_from_rig * problem.imu_from_rig().origin_in_source())};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  const std::span<const VisionPose> poses = problem.poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    InertialState& state = unknowns.states.emplace_back();
    state.rig_from_world = poses[i].rig_from_world;
    if (!poses[i].is_seen && i > 0 && chain.intervals[i - 1]) {
      const Eigen::Quaterniond turned =
          turn_of_rig(*chain.intervals[i - 1], rotation.imu_from_rig) *
          unknowns.states[i - 1].rig_from_world.rotation;
      state.rig_from_world = {turned, -(turned * poses[i].rig_from_world.origin_in_source())};
    }
    state.biases.gyroscope = rotation.gyroscope_bias;
    const VisionPose& before = poses[i == 0 ? 0 : i - 1];
    const VisionPose& after = poses[std::min(i + 1, poses.size() - 1)];
    const auto between_ns = static_cast<double>(after.timestamp_ns - before.timestamp_ns);
    state.velocity =
        std::exp(setup.log_scale) * 1e9 / between_ns *
        (after.rig_from_world.origin_in_source() - before.rig_from_world.origin_in_source());
    if (i == chain.intervals.size() || !chain.intervals[i]) continue;
    force += world_from_imu(state, setup).rotation * chain.intervals[i]->delta().velocity;
  }
  setup.gravity = -problem.options.gravity * force.normalized();
  return unknowns;
}

/// What the squared error is in the mean: measured numbers and beliefs without what is fitted.
double degrees_of_freedom(const PreintegrationChain& chain, std::span<const VisionPose> poses) {
  double freedom = 8.0 - 10.0 + 6.0;
  for (const VisionPose& pose : poses) freedom += (pose.is_seen ? 6.0 : 0.0) - 15.0;
  for (const auto& interval : chain.intervals) freedom += interval ? 15.0 : 6.0;
  return freedom;
}

/// Refines, and cuts and integrates anew until time shift and biases stay. The chain is left as it
/// was refined with.
InertialRefinement refine_with_cuts(const StartProblem& problem,
                                    InertialUnknowns unknowns,
                                    PreintegrationChain& chain) {
  InertialRefinement refined{std::move(unknowns), {}, 0.0};
  const auto has_samples = [](const auto& interval) { return interval.has_value(); };
  for (int cut = 0; cut < kMaxCuts; ++cut) {
    const double sigma = problem.options.log_scale_sigma;
    refined = refine_inertial_start(problem, chain, std::move(refined.unknowns), sigma);
    InertialSetup& setup = refined.unknowns.setup;
    const std::vector<InertialState>& states = refined.unknowns.states;
    if (std::abs(setup.time_shift_change_s) > kStillShift) {
      PreintegrationChain next =
          cut_chain(problem, chain.time_shift_s + setup.time_shift_change_s, states);
      if (std::ranges::none_of(next.intervals, has_samples)) return refined;
      chain = std::move(next);
      setup.time_shift_change_s = 0.0;
      continue;
    }
    bool is_integrated_anew = false;
    for (std::size_t i = 0; i < chain.intervals.size(); ++i) {
      auto& interval = chain.intervals[i];
      if (interval && interval->reintegrate_if_far(states[i].biases)) is_integrated_anew = true;
    }
    if (!is_integrated_anew) break;
  }
  return refined;
}

/// Where motion hardly tells the scale, the joint maximum is no estimate: the smaller the scale,
/// the less vision says in metres, and the better any noise fits (Neyman and Scott 1948). So it is
/// what was believed before, as sure as that, and all else follows it to first order.
InertialRefinement refine_at_believed_scale(const StartProblem& problem,
                                            const PreintegrationChain& chain,
                                            InertialUnknowns unknowns) {
  constexpr double kHeldSigma = 1e-4;
  const double growth = std::exp(problem.options.log_scale - unknowns.setup.log_scale);
  for (InertialState& state : unknowns.states) state.velocity *= growth;
  unknowns.setup.log_scale = problem.options.log_scale;
  InertialRefinement refined =
      refine_inertial_start(problem, chain, std::move(unknowns), kHeldSigma);
  const double variance = problem.options.log_scale_sigma * problem.options.log_scale_sigma;
  for (Matrix25d& covariance : refined.covariances) {
    const double held = covariance(2, 2);
    const Eigen::Matrix<double, 25, 1> by_scale = covariance.col(2) / held;
    covariance += (variance - held) * by_scale * by_scale.transpose();
  }
  return refined;
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
  const std::optional<RotationStart> rotation = rotation_start(problem);
  if (!rotation) return std::nullopt;
  InertialState still;
  still.biases.gyroscope = rotation->gyroscope_bias;
  PreintegrationChain chain =
      cut_chain(problem, rotation->time_shift_s, std::vector(poses.size(), still));
  InertialRefinement refined =
      refine_with_cuts(problem, first_guess(problem, chain, *rotation), chain);
  if (std::sqrt(refined.covariances.back()(2, 2)) > kWeakScale) {
    const double squared_error = refined.squared_error;
    refined = refine_at_believed_scale(problem, chain, std::move(refined.unknowns));
    refined.squared_error = squared_error;
  }
  if (!refined.covariances.back().allFinite()) return std::nullopt;
  InertialStart start;
  start.time_shift_s =
      chain.time_shift_s + std::exchange(refined.unknowns.setup.time_shift_change_s, 0.0);
  start.setup = refined.unknowns.setup;
  start.states = std::move(refined.unknowns.states);
  start.covariances = std::move(refined.covariances);
  start.squared_error = refined.squared_error;
  start.degrees_of_freedom = degrees_of_freedom(chain, poses);
  return start;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_path.h"

#include <cmath>
#include <optional>
#include <utility>

#include "waymark/imu/imu_health.h"
#include "waymark/imu/inertial_residual.h"

namespace waymark {
namespace {

/// States of the samples between two others, without what is missing to the second one; the last
/// is that of the second one. Empty where samples are missing.
std::vector<NavigationState> integrate(const NavigationState& first,
                                       std::int64_t end_ns,
                                       const ImuSamples& samples,
                                       const InertialReport& report) {
  const InertialSetup setup{report.gravity_in_world, 0.0, report.imu_from_rig, 0.0};
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * report.time_shift_s));
  const std::vector<ImuSample> between =
      samples.between(first.timestamp_ns + shift_ns, end_ns + shift_ns);
  std::vector<NavigationState> states;
  InertialEstimate estimate{{first.world_from_rig.inverse(), first.velocity, first.biases}, {}};
  for (std::size_t i = 1; i < between.size(); ++i) {
    const auto next = predict(estimate,
                              samples,
                              between[i - 1].timestamp_ns,
                              between[i].timestamp_ns,
                              default_imu_noise(),
                              setup);
    if (!next) return {};
    estimate.state = next->state;
    states.push_back({between[i].timestamp_ns - shift_ns,
                      estimate.state.rig_from_world.inverse(),
                      estimate.state.velocity,
                      first.covariance,
                      first.biases});
  }
  return states;
}

}  // namespace

std::vector<NavigationState> at_imu_rate(std::span<const NavigationState> states,
                                         const ImuSamples& samples,
                                         const InertialReport& report) {
  std::vector<NavigationState> all;
  for (std::size_t i = 0; i < states.size(); ++i) {
    all.push_back(states[i]);
    if (i + 1 == states.size()) break;
    const NavigationState& second = states[i + 1];
    const std::int64_t duration_ns = second.timestamp_ns - states[i].timestamp_ns;
    if (duration_ns > kMaxBridgedNs) continue;
    auto between = integrate(states[i], second.timestamp_ns, samples, report);
    if (between.empty()) continue;
    const NavigationState end = between.back();
    between.pop_back();
    const Vector6d missing = (end.world_from_rig.inverse() * second.world_from_rig).log();
    for (NavigationState& state : between) {
      const double part = static_cast<double>(state.timestamp_ns - states[i].timestamp_ns) /
                          static_cast<double>(duration_ns);
      state.world_from_rig = state.world_from_rig * Rigid3::exp(part * missing);
      state.velocity += part * (second.velocity - end.velocity);
      all.push_back(state);
    }
  }
  return all;
}

}  // namespace waymark

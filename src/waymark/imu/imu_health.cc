// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_health.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "waymark/base/median.h"

namespace waymark {
namespace {

constexpr double kNarrowTurnRange = 2.0;    ///< rad/s.
constexpr double kNarrowForceRange = 15.0;  ///< m/s^2.
/// Both ends of a range differ by a bit, and conversions of units round.
constexpr double kAtEnd = 0.9995;

SensorHealth sensor_health(std::span<const ImuSample> samples,
                           Eigen::Vector3d ImuSample::*sensor,
                           double narrow_range) {
  SensorHealth health;
  if (samples.size() < 2) return health;
  double largest = 0.0;
  health.is_constant = true;
  for (const ImuSample& sample : samples) {
    largest = std::max(largest, (sample.*sensor).cwiseAbs().maxCoeff());
    if (sample.*sensor != samples.front().*sensor) health.is_constant = false;
  }
  if (health.is_constant || largest < narrow_range) return health;
  const auto stays = [&](std::size_t i, std::size_t neighbour) {
    const Eigen::Vector3d& value = samples[i].*sensor;
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_at_end = std::abs(value[axis]) >= kAtEnd * largest;
      if (is_at_end && value[axis] == (samples[neighbour].*sensor)[axis]) return true;
    }
    return false;
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if ((i > 0 && stays(i, i - 1)) || (i + 1 < samples.size() && stays(i, i + 1))) ++count;
  }
  health.saturated_share = static_cast<double>(count) / static_cast<double>(samples.size());
  return health;
}

}  // namespace

ImuHealth imu_health(std::span<const ImuSample> samples) {
  ImuHealth health;
  std::vector<std::int64_t> periods;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    periods.push_back(samples[i].timestamp_ns - samples[i - 1].timestamp_ns);
  }
  if (!periods.empty()) health.rate_hz = 1e9 / static_cast<double>(median(periods));
  health.gyroscope = sensor_health(samples, &ImuSample::angular_velocity, kNarrowTurnRange);
  health.accelerometer = sensor_health(samples, &ImuSample::acceleration, kNarrowForceRange);
  return health;
}

}  // namespace waymark

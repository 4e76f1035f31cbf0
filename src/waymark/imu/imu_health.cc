// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_health.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "waymark/base/median.h"

namespace waymark {
namespace {

constexpr double kNarrowTurnRange = 2.0;    ///< rad/s.
constexpr double kNarrowForceRange = 15.0;  ///< m/s^2.
/// Both ends of a range differ by a bit, and conversions of units round.
constexpr double kAtEnd = 0.9995;

/// Stretches of one second are at rest if they are as still as any consumer IMU on a table, do not
/// turn by more than a bias, and weigh about what they should, and no more than so much less still
/// than the stillest of them.
const Eigen::Array2d kStill(0.02, 0.15);  ///< rad/s and m/s^2.
constexpr double kBiasTurn = 0.1;         ///< rad/s.
constexpr double kBiasForce = 0.5;        ///< m/s^2.
constexpr double kStillest = 1.5;
constexpr std::size_t kMinStretches = 3;
constexpr double kMaxLag = 0.1;  ///< s.
/// Output that never changes has no noise, which nothing would outweigh.
constexpr double kLeastShare = 0.1;  ///< Of the default.

SensorHealth sensor_health(std::span<const ImuSample> samples,
                           Eigen::Vector3d ImuSample::*sensor,
                           double narrow_range) {
  SensorHealth health;
  const auto num_samples = static_cast<double>(samples.size());
  double largest = 0.0;
  health.is_constant = true;
  for (const ImuSample& sample : samples) {
    health.mean_length += (sample.*sensor).norm() / num_samples;
    largest = std::max(largest, (sample.*sensor).cwiseAbs().maxCoeff());
    if (sample.*sensor != samples.front().*sensor) health.is_constant = false;
  }
  if (health.is_constant || largest < narrow_range) return health;
  bool did_stay = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Array3d value = samples[i].*sensor;
    const auto is_at_end = value.abs() >= kAtEnd * largest;
    const bool stays =
        i + 1 < samples.size() && (is_at_end && value == (samples[i + 1].*sensor).array()).any();
    if (stays || did_stay) health.saturated_share += 1.0 / num_samples;
    did_stay = stays;
  }
  return health;
}

/// Angular velocities and accelerations of a second at rest.
struct RestStretch {
  Eigen::Matrix<double, 6, Eigen::Dynamic> values;
  Eigen::Array2d sigma;  ///< Of both sensors, rad/s and m/s^2.
};

/// Mean squares of both sensors.
Eigen::Array2d per_sensor(const Eigen::Matrix<double, 6, 1>& squares) {
  return {squares.head<3>().mean(), squares.tail<3>().mean()};
}

std::vector<RestStretch> rest_stretches(std::span<const ImuSample> samples, double rate_hz) {
  std::vector<RestStretch> stretches;
  Eigen::Array2d stillest = kStill;
  const auto size = static_cast<std::size_t>(std::max(2L, std::lround(rate_hz)));
  for (std::size_t first = 0; first + size <= samples.size(); first += size) {
    const std::span<const ImuSample> part = samples.subspan(first, size);
    if (part.back().timestamp_ns - part.front().timestamp_ns > 1'050'000'000) continue;  // A gap.
    RestStretch stretch;
    stretch.values.resize(6, static_cast<Eigen::Index>(size));
    for (std::size_t i = 0; i < size; ++i) {
      stretch.values.col(static_cast<Eigen::Index>(i)) << part[i].angular_velocity,
          part[i].acceleration;
    }
    const Eigen::Matrix<double, 6, 1> mean = stretch.values.rowwise().mean();
    stretch.sigma =
        per_sensor((stretch.values.colwise() - mean).cwiseAbs2().rowwise().mean()).sqrt();
    if ((stretch.sigma > kStill).any() || mean.head<3>().norm() > kBiasTurn ||
        std::abs(mean.tail<3>().norm() - kStandardGravity) > kBiasForce) {
      continue;
    }
    stillest = stillest.min(stretch.sigma);
    stretches.push_back(std::move(stretch));
  }
  std::erase_if(stretches, [&](const RestStretch& stretch) {
    return (stretch.sigma > kStillest * stillest).any();
  });
  return stretches;
}

/// Allan variances of means of so many samples, for both sensors.
Eigen::Array2d allan_variances(std::span<const RestStretch> stretches, Eigen::Index count) {
  Eigen::Array2d sum = Eigen::Array2d::Zero();
  double number = 0.0;
  for (const RestStretch& stretch : stretches) {
    for (Eigen::Index at = 0; at + 2 * count <= stretch.values.cols(); at += count) {
      sum += 0.5 * per_sensor((stretch.values.middleCols(at + count, count).rowwise().mean() -
                               stretch.values.middleCols(at, count).rowwise().mean())
                                  .cwiseAbs2());
      number += 1.0;
    }
  }
  return sum / number;
}

void measure_rest(std::span<const ImuSample> samples, ImuHealth& health) {
  const std::vector<RestStretch> stretches = rest_stretches(samples, health.rate_hz);
  health.rest_s = static_cast<double>(stretches.size());
  if (stretches.size() < kMinStretches) return;
  Eigen::Array2d squared_density = Eigen::Array2d::Zero();
  for (Eigen::Index count = 1; static_cast<double>(count) <= kMaxLag * health.rate_hz; count *= 2) {
    const double lag = static_cast<double>(count) / health.rate_hz;
    squared_density = squared_density.max(lag * allan_variances(stretches, count));
  }
  ImuNoise noise = default_imu_noise();
  noise.gyroscope = std::max(std::sqrt(squared_density[0]), kLeastShare * noise.gyroscope);
  noise.accelerometer = std::max(std::sqrt(squared_density[1]), kLeastShare * noise.accelerometer);
  health.noise = noise;
}

}  // namespace

ImuNoise default_imu_noise() { return {2.4e-4, 3.5e-3, 1.9e-5, 3e-3}; }

ImuHealth imu_health(std::span<const ImuSample> samples) {
  ImuHealth health;
  if (samples.size() < 2) return health;
  std::vector<std::int64_t> steps_ns;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps_ns.push_back(samples[i].timestamp_ns - samples[i - 1].timestamp_ns);
  }
  const auto usual_ns = static_cast<double>(median(std::vector(steps_ns)));
  health.rate_hz = 1e9 / usual_ns;
  health.duration_s =
      1e-9 * static_cast<double>(samples.back().timestamp_ns - samples.front().timestamp_ns);
  for (std::size_t i = 0; i < steps_ns.size(); ++i) {
    if (static_cast<double>(steps_ns[i]) <= 2.5 * usual_ns) continue;
    health.gaps.push_back({samples[i].timestamp_ns, steps_ns[i]});
  }
  health.gyroscope = sensor_health(samples, &ImuSample::angular_velocity, kNarrowTurnRange);
  health.accelerometer = sensor_health(samples, &ImuSample::acceleration, kNarrowForceRange);
  measure_rest(samples, health);
  return health;
}

}  // namespace waymark

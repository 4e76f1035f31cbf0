// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_health.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "waymark/base/check.h"
#include "waymark/base/median.h"

namespace waymark {
namespace {

/// A second is at rest if it is as still as any consumer IMU on a table, does not turn by more than
/// a bias, and weighs about what it should.
constexpr double kStillTurn = 0.02;   ///< rad/s.
constexpr double kStillForce = 0.15;  ///< m/s^2.
constexpr double kBiasTurn = 0.1;     ///< rad/s.
constexpr double kBiasForce = 0.5;    ///< m/s^2.
constexpr std::size_t kMinRests = 3;
constexpr std::size_t kPartsOfRest = 10;  ///< Of which the Allan deviation takes means.
/// Output that never changes has no noise, which nothing would outweigh.
constexpr double kLeastShare = 0.1;  ///< Of the default.

SensorHealth sensor_health(std::span<const ImuSample> samples, Eigen::Vector3d ImuSample::*sensor) {
  SensorHealth health{.is_constant = true};
  for (const ImuSample& sample : samples) {
    health.mean_length += (sample.*sensor).norm() / static_cast<double>(samples.size());
    if (sample.*sensor != samples.front().*sensor) health.is_constant = false;
  }
  return health;
}

Eigen::Vector3d mean_of(std::span<const ImuSample> samples, Eigen::Vector3d ImuSample::*sensor) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples) sum += sample.*sensor;
  return sum / static_cast<double>(samples.size());
}

/// The Allan variance per axis of a sensor in a second; nothing where it is not still. mean: of the
/// second.
std::optional<double> rest_variance(std::span<const ImuSample> second,
                                    Eigen::Vector3d ImuSample::*sensor,
                                    const Eigen::Vector3d& mean,
                                    double still) {
  double variance = 0.0;
  for (const ImuSample& sample : second) variance += (sample.*sensor - mean).squaredNorm() / 3.0;
  if (variance > still * still * static_cast<double>(second.size())) return std::nullopt;
  const std::size_t size = second.size() / kPartsOfRest;
  double sum = 0.0;
  for (std::size_t i = 1; i < kPartsOfRest; ++i) {
    sum += (mean_of(second.subspan(i * size, size), sensor) -
            mean_of(second.subspan((i - 1) * size, size), sensor))
               .squaredNorm();
  }
  return sum / 3.0 / 2.0 / static_cast<double>(kPartsOfRest - 1);
}

void measure_rest(std::span<const ImuSample> samples, ImuHealth& health) {
  const auto size = static_cast<std::size_t>(health.rate_hz + 0.5);
  if (size < kPartsOfRest) return;
  std::vector<double> turns, forces;
  for (std::size_t first = 0; first + size <= samples.size(); first += size) {
    const std::span<const ImuSample> second = samples.subspan(first, size);
    constexpr std::int64_t kMostNs = 1'050'000'000;
    if (second.back().timestamp_ns - second.front().timestamp_ns > kMostNs) continue;  // A gap.
    const Eigen::Vector3d turn = mean_of(second, &ImuSample::angular_velocity);
    const Eigen::Vector3d force = mean_of(second, &ImuSample::acceleration);
    if (turn.norm() > kBiasTurn || std::abs(force.norm() - kStandardGravity) > kBiasForce) continue;
    const auto of_turn = rest_variance(second, &ImuSample::angular_velocity, turn, kStillTurn);
    const auto of_force = rest_variance(second, &ImuSample::acceleration, force, kStillForce);
    if (!of_turn || !of_force) continue;
    turns.push_back(*of_turn);
    forces.push_back(*of_force);
  }
  health.rest_s = static_cast<double>(turns.size());
  if (turns.size() < kMinRests) return;
  const double lag_s = static_cast<double>(size / kPartsOfRest) / health.rate_hz;
  ImuNoise noise = default_imu_noise();
  noise.gyroscope = std::max(std::sqrt(lag_s * median(turns)), kLeastShare * noise.gyroscope);
  noise.accelerometer =
      std::max(std::sqrt(lag_s * median(forces)), kLeastShare * noise.accelerometer);
  health.noise = noise;
}

double shown_density(std::span<const ImuSample> samples, Eigen::Vector3d ImuSample::*sensor) {
  std::vector<double> squared, steps_s;
  for (std::size_t i = 2; i < samples.size(); ++i) {
    const Eigen::Vector3d second =
        samples[i - 2].*sensor - 2.0 * (samples[i - 1].*sensor) + samples[i].*sensor;
    squared.push_back(second.squaredNorm());
    steps_s.push_back(1e-9 *
                      static_cast<double>(samples[i].timestamp_ns - samples[i - 1].timestamp_ns));
  }
  constexpr double kMedianOfThree = 2.366;  // Of the chi-square distribution for three axes.
  constexpr double kOfSecondDifference = 1.0 + 4.0 + 1.0;
  return std::sqrt(median(squared) / (kMedianOfThree * kOfSecondDifference) * median(steps_s));
}

/// Variance of samples at rest to that of white noise as their second differences show it.
constexpr double kMaxRestGrowth = 1.7;

}  // namespace

ImuNoise shown_imu_noise(std::span<const ImuSample> samples) {
  WAYMARK_CHECK(samples.size() >= 3);
  return {.gyroscope = shown_density(samples, &ImuSample::angular_velocity),
          .accelerometer = shown_density(samples, &ImuSample::acceleration)};
}

bool shows_no_motion(std::span<const ImuSample> samples) {
  const ImuNoise noise = shown_imu_noise(samples);
  const double seconds =
      1e-9 * static_cast<double>(samples.back().timestamp_ns - samples.front().timestamp_ns);
  const double root_rate = std::sqrt(static_cast<double>(samples.size() - 1) / seconds);
  const auto is_noise = [&](Eigen::Vector3d ImuSample::*sensor, double density) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : samples) mean += sample.*sensor;
    mean /= static_cast<double>(samples.size());
    double sum = 0.0;
    for (const ImuSample& sample : samples) sum += (sample.*sensor - mean).squaredNorm();
    const double white = density * root_rate;
    return sum > 0.0 &&
           sum <= kMaxRestGrowth * 3.0 * white * white * static_cast<double>(samples.size());
  };
  return is_noise(&ImuSample::angular_velocity, noise.gyroscope) &&
         is_noise(&ImuSample::acceleration, noise.accelerometer);
}

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
  health.gyroscope = sensor_health(samples, &ImuSample::angular_velocity);
  health.accelerometer = sensor_health(samples, &ImuSample::acceleration);
  measure_rest(samples, health);
  return health;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_noise.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "waymark/imu/inertial_residual.h"

namespace waymark {
namespace {

using Vector6Samples = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Stretches of one second are at rest if they are as still as any consumer IMU on a table, do not
/// turn by more than a bias, and weigh about what they should, and no more than so much less still
/// than the stillest of them.
constexpr double kStretchSeconds = 1.0;
constexpr double kStillTurn = 0.02;   ///< rad/s.
constexpr double kStillForce = 0.15;  ///< m/s^2.
constexpr double kBiasTurn = 0.1;     ///< rad/s.
constexpr double kBiasForce = 0.5;    ///< m/s^2.
constexpr double kStillest = 1.5;
constexpr std::size_t kMinStretches = 3;
constexpr double kMaxLag = 0.1;  ///< s.
/// Output that never changes has no noise, which nothing would outweigh.
constexpr double kLeastShare = 0.1;  ///< Of the default.

struct RestStretch {
  Vector6Samples values;    ///< Angular velocities and accelerations.
  double turn_sigma = 0.0;  ///< rad/s.
  double force_sigma = 0.0;
  bool is_still = false;
};

RestStretch rest_stretch(std::span<const ImuSample> samples) {
  RestStretch stretch;
  stretch.values.resize(6, static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    stretch.values.col(static_cast<Eigen::Index>(i)) << samples[i].angular_velocity,
        samples[i].acceleration;
  }
  const Eigen::Matrix<double, 6, 1> mean = stretch.values.rowwise().mean();
  const Eigen::Matrix<double, 6, 1> variance =
      (stretch.values.colwise() - mean).cwiseAbs2().rowwise().mean();
  stretch.turn_sigma = std::sqrt(variance.head<3>().mean());
  stretch.force_sigma = std::sqrt(variance.tail<3>().mean());
  stretch.is_still = stretch.turn_sigma < kStillTurn && stretch.force_sigma < kStillForce &&
                     mean.head<3>().norm() < kBiasTurn &&
                     std::abs(mean.tail<3>().norm() - kStandardGravity) < kBiasForce;
  return stretch;
}

std::vector<RestStretch> rest_stretches(const ImuSamples& samples) {
  std::vector<RestStretch> stretches;
  const std::span<const ImuSample> all = samples.all();
  const double period = 1e-9 * static_cast<double>(samples.period_ns());
  const auto size = static_cast<std::size_t>(std::lround(kStretchSeconds / period));
  double turn = kStillTurn, force = kStillForce;
  for (std::size_t first = 0; first + size <= all.size(); first += size) {
    const std::span<const ImuSample> part = all.subspan(first, size);
    const auto coverage = samples.coverage(part.front().timestamp_ns, part.back().timestamp_ns);
    if (coverage != ImuCoverage::kWhole) continue;
    RestStretch stretch = rest_stretch(part);
    if (!stretch.is_still) continue;
    turn = std::min(turn, stretch.turn_sigma);
    force = std::min(force, stretch.force_sigma);
    stretches.push_back(std::move(stretch));
  }
  std::erase_if(stretches, [&](const RestStretch& stretch) {
    return stretch.turn_sigma > kStillest * turn || stretch.force_sigma > kStillest * force;
  });
  return stretches;
}

/// Allan variances (IEEE Std 952-1997, annex C) of means of so many samples, for both sensors.
Eigen::Vector2d allan_variances(std::span<const RestStretch> stretches, Eigen::Index count) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double number = 0.0;
  for (const RestStretch& stretch : stretches) {
    for (Eigen::Index at = 0; at + 2 * count <= stretch.values.cols(); at += count) {
      const Eigen::Matrix<double, 6, 1> difference =
          stretch.values.middleCols(at + count, count).rowwise().mean() -
          stretch.values.middleCols(at, count).rowwise().mean();
      sum += 0.5 * Eigen::Vector2d(difference.head<3>().squaredNorm(),
                                   difference.tail<3>().squaredNorm());
      number += 3.0;
    }
  }
  return sum / number;
}

}  // namespace

ImuNoise default_imu_noise() { return {2.4e-4, 3.5e-3, 1.9e-5, 3e-3}; }

std::optional<ImuNoise> estimate_imu_noise(const ImuSamples& samples) {
  if (samples.all().size() < 2) return std::nullopt;
  const std::vector<RestStretch> stretches = rest_stretches(samples);
  if (stretches.size() < kMinStretches) return std::nullopt;
  const double period = 1e-9 * static_cast<double>(samples.period_ns());
  Eigen::Vector2d squared_density = Eigen::Vector2d::Zero();
  for (Eigen::Index count = 1; static_cast<double>(count) * period <= kMaxLag; count *= 2) {
    const double lag = static_cast<double>(count) * period;
    squared_density = squared_density.cwiseMax(lag * allan_variances(stretches, count));
  }
  ImuNoise noise = default_imu_noise();
  noise.gyroscope = std::max(std::sqrt(squared_density[0]), kLeastShare * noise.gyroscope);
  noise.accelerometer = std::max(std::sqrt(squared_density[1]), kLeastShare * noise.accelerometer);
  return noise;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/imu/imu.h"
#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kDegPerRadian = 180.0 / std::numbers::pi;
/// So close that the spline of these keys is within a tenth of a degree of where they go.
constexpr double kRideKeysPerSecond = 20.0;

/// From 0 to 1, without a jump of its slope.
double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Relative to full speed, at a phase of [0, 1]; it brakes and starts in a tenth of the time each.
double speed_with_stops(double phase) {
  double speed = 1.0;
  for (const double stop : {0.3, 0.7}) {
    speed = std::min(speed, smooth_step((std::abs(phase - stop) - 0.05) / 0.1));
  }
  return speed;
}

/// Of the keys from one before the first pose to one after the last, as a spline has them: what of
/// the way each has behind it, in [0, 1].
template <class Speed>
std::vector<double> progress(double duration_s, Speed speed) {
  constexpr int kSteps = 20;
  const int count = std::max(1, static_cast<int>(std::ceil(kRideKeysPerSecond * duration_s)));
  std::vector<double> shares = {0.0};
  for (int i = 0; i < count + 2; ++i) {
    double sum = shares.back();
    for (int k = 0; k < kSteps; ++k) sum += speed((i - 1 + (k + 0.5) / kSteps) / count) / kSteps;
    shares.push_back(sum);
  }
  for (double& share : shares) share /= shares.back();
  return shares;
}

/// Turns keys to where the way goes, without jumps of whole turns.
void look_ahead(const Motion& way,
                const std::vector<double>& shares,
                std::vector<MotionKey>& keys) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const double seconds = shares[i] * way.duration_s();
    const Vector3d direction = way.key(seconds + 1e-3).position - way.key(seconds - 1e-3).position;
    const double heading_deg = kDegPerRadian * std::atan2(direction.y(), direction.x());
    const double before_deg = i == 0 ? heading_deg : keys[i - 1].yaw_deg;
    keys[i].yaw_deg = before_deg + std::remainder(heading_deg - before_deg, 360.0);
    keys[i].pitch_deg = keys[i].roll_deg = 0.0;
  }
}

std::vector<MotionKey> keys_at(const Motion& way, const std::vector<double>& shares) {
  std::vector<MotionKey> keys;
  for (const double share : shares) keys.push_back(way.key(share * way.duration_s()));
  return keys;
}

/// Tilts keys so that the thrust, which is along the rig's upward axis, accelerates as they do.
void bank(double duration_s, std::vector<MotionKey>& keys) {
  const double keys_per_s = static_cast<double>(keys.size() - 3) / duration_s;
  const std::size_t last = keys.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t middle = std::clamp<std::size_t>(i, 1, last - 1);
    const Vector3d second_difference =
        keys[middle + 1].position - 2.0 * keys[middle].position + keys[middle - 1].position;
    Vector3d thrust = keys_per_s * keys_per_s * second_difference;
    thrust.z() += kStandardGravity;
    const double yaw = keys[i].yaw_deg / kDegPerRadian;
    const double ahead = thrust.dot(Vector3d(std::cos(yaw), std::sin(yaw), 0.0));
    const double right = thrust.dot(Vector3d(std::sin(yaw), -std::cos(yaw), 0.0));
    keys[i].pitch_deg = -kDegPerRadian * std::atan2(ahead, thrust.z());
    keys[i].roll_deg = kDegPerRadian * std::atan2(right, std::hypot(ahead, thrust.z()));
  }
}

}  // namespace

std::vector<MotionKey> drive_along(const Motion& way, double duration_s) {
  const std::vector<double> shares = progress(duration_s, speed_with_stops);
  std::vector<MotionKey> keys = keys_at(way, shares);
  look_ahead(way, shares, keys);
  return keys;
}

std::vector<MotionKey> fly_along(const Motion& way, double duration_s) {
  constexpr double kRiseM = 0.15;
  constexpr int kNumRises = 5;
  const std::vector<double> shares = progress(duration_s, [](double) { return 1.0; });
  std::vector<MotionKey> keys = keys_at(way, shares);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    keys[i].position.z() += kRiseM * std::sin(2.0 * std::numbers::pi * kNumRises * shares[i]);
  }
  look_ahead(way, shares, keys);
  bank(duration_s, keys);
  return keys;
}

std::vector<MotionKey> rest_before(const Motion& way, double rest_s, double duration_s) {
  const double rest = std::min(rest_s / duration_s, 0.5);
  const double start = std::min(1.0 / duration_s, 0.25);
  return keys_at(
      way, progress(duration_s, [&](double phase) { return smooth_step((phase - rest) / start); }));
}

}  // namespace waymark

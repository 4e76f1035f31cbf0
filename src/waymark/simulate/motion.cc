// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr int kNumWaves = 4;

void add_scaled(const MotionKey& key, double weight, MotionKey& sum) {
  sum.position += weight * key.position;
  sum.yaw_deg += weight * key.yaw_deg;
  sum.pitch_deg += weight * key.pitch_deg;
  sum.roll_deg += weight * key.roll_deg;
}

Vector3d random_signs(Rng& rng, double amplitude) {
  const double x = rng.uniform(-amplitude, amplitude);
  const double y = rng.uniform(-amplitude, amplitude);
  return {x, y, rng.uniform(-amplitude, amplitude)};
}

}  // namespace

Rigid3 pose_of(const MotionKey& key) {
  const double yaw = key.yaw_deg * kRadPerDeg;
  const double pitch = key.pitch_deg * kRadPerDeg;
  const Vector3d forward(
      std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  Eigen::Matrix3d level;
  level << right, forward.cross(right), forward;
  const Eigen::AngleAxisd roll(key.roll_deg * kRadPerDeg, Vector3d::UnitZ());
  return {(Eigen::Quaterniond(level) * Eigen::Quaterniond(roll)).normalized(), key.position};
}

Motion::Motion(std::vector<MotionKey> keys, double duration_s, const Sway& sway)
    : keys_(std::move(keys)), duration_s_(duration_s) {
  WAYMARK_CHECK(keys_.size() >= 4 && duration_s > 0.0);
  if (sway.position_m <= 0.0 && sway.angle_deg <= 0.0) return;
  Rng rng(sway.seed, 0);
  for (int i = 0; i < kNumWaves; ++i) {
    // Faster waves are smaller, so that all shake about as fast.
    const double frequency = 0.4 * std::pow(5.0, static_cast<double>(i) / (kNumWaves - 1));
    const double share = 0.4 / frequency;
    const Vector3d position = random_signs(rng, sway.position_m * share);
    const Vector3d angle = random_signs(rng, sway.angle_deg * share);
    waves_.push_back({position, angle, frequency, rng.uniform(0.0, kTwoPi)});
  }
}

MotionKey Motion::spline(double seconds) const {
  const double segments = static_cast<double>(keys_.size() - 3);
  const double at = std::clamp(seconds / duration_s_, 0.0, 1.0) * segments;
  const std::size_t first = std::min(static_cast<std::size_t>(at), keys_.size() - 4);
  const double t = at - static_cast<double>(first);
  const double s = 1.0 - t;
  MotionKey sum;
  add_scaled(keys_[first], s * s * s / 6.0, sum);
  add_scaled(keys_[first + 1], (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, sum);
  add_scaled(keys_[first + 2], (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0, sum);
  add_scaled(keys_[first + 3], t * t * t / 6.0, sum);
  return sum;
}

Rigid3 Motion::world_from_rig(double seconds) const {
  const double clamped = std::clamp(seconds, 0.0, duration_s_);
  MotionKey key = spline(clamped);
  for (const Wave& wave : waves_) {
    const double value = std::sin(kTwoPi * wave.frequency_hz * clamped + wave.phase_rad);
    key.position += value * wave.position_m;
    key.yaw_deg += value * wave.angle_deg.x();
    key.pitch_deg += value * wave.angle_deg.y();
    key.roll_deg += value * wave.angle_deg.z();
  }
  return pose_of(key);
}

}  // namespace waymark

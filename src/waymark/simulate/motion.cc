// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kWaveTurn = 2.0 * std::numbers::pi;
constexpr double kRadPerKeyDeg = std::numbers::pi / 180.0;
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

/// Of four control points, at t of [0, 1] between the middle two, or the derivatives of these
/// weights by t (de Boor 1978).
std::array<double, 4> spline_weights(double t, int order) {
  const double s = 1.0 - t;
  if (order == 1) {
    const double ahead = 0.5 * t * (3.0 * t - 4.0);
    const double behind = -0.5 * s * (3.0 * s - 4.0);
    return {-0.5 * s * s, ahead, behind, 0.5 * t * t};
  }
  if (order == 2) return {s, 3.0 * t - 2.0, 3.0 * s - 2.0, t};
  return {s * s * s / 6.0,
          (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
          (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
          t * t * t / 6.0};
}

}  // namespace

Rigid3 pose_of(const MotionKey& key) {
  const double yaw = key.yaw_deg * kRadPerKeyDeg;
  const double pitch = key.pitch_deg * kRadPerKeyDeg;
  const Vector3d forward(
      std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  Eigen::Matrix3d level;
  level << right, forward.cross(right), forward;
  const Eigen::AngleAxisd roll(key.roll_deg * kRadPerKeyDeg, Vector3d::UnitZ());
  return {(Eigen::Quaterniond(level) * Eigen::Quaterniond(roll)).normalized(), key.position};
}

Motion::Motion(std::vector<MotionKey> keys, double duration_s, const CameraShake& sway)
    : keys_(std::move(keys)), duration_s_(duration_s) {
  WAYMARK_CHECK(keys_.size() >= 4 && duration_s > 0.0);
  if (sway.position_m <= 0.0 && sway.angle_deg <= 0.0) return;
  Rng rng(sway.seed, 0);
  for (int i = 0; i < kNumWaves; ++i) {
    // Faster waves are smaller, so that all shake about as fast.
    const double frequency =
        sway.lowest_hz * std::pow(5.0, static_cast<double>(i) / (kNumWaves - 1));
    const double share = sway.lowest_hz / frequency;
    const Vector3d position = random_signs(rng, sway.position_m * share);
    const Vector3d angle = random_signs(rng, sway.angle_deg * share);
    waves_.push_back({position, angle, frequency, rng.uniform(0.0, kWaveTurn)});
  }
}

MotionKey Motion::spline(double seconds, int order) const {
  const double segments = static_cast<double>(keys_.size() - 3);
  const double at = std::clamp(seconds / duration_s_, 0.0, 1.0) * segments;
  const std::size_t first = std::min(static_cast<std::size_t>(at), keys_.size() - 4);
  const std::array<double, 4> weights = spline_weights(at - static_cast<double>(first), order);
  const double scale = std::pow(segments / duration_s_, order);
  MotionKey sum;
  for (std::size_t i = 0; i < 4; ++i) add_scaled(keys_[first + i], scale * weights[i], sum);
  return sum;
}

MotionKey Motion::key(double seconds, int order) const {
  WAYMARK_CHECK(order >= 0 && order <= 2);
  const double clamped = std::clamp(seconds, 0.0, duration_s_);
  MotionKey key = spline(clamped, order);
  for (const Wave& wave : waves_) {
    const double rate = kWaveTurn * wave.frequency_hz;
    // Each derivative of a sine is a quarter of a turn ahead.
    const double value = std::pow(rate, order) *
                         std::sin(rate * clamped + wave.phase_rad + 0.25 * order * kWaveTurn);
    key.position += value * wave.position_m;
    key.yaw_deg += value * wave.angle_deg.x();
    key.pitch_deg += value * wave.angle_deg.y();
    key.roll_deg += value * wave.angle_deg.z();
  }
  return key;
}

Rigid3 Motion::world_from_rig(double seconds) const { return pose_of(key(seconds)); }

MotionState Motion::state(double seconds) const {
  MotionKey at = key(seconds);
  const MotionKey first = key(seconds, 1);
  MotionKey second = key(seconds, 2);
  const double beyond = seconds - std::clamp(seconds, 0.0, duration_s_);
  if (beyond != 0.0) {
    add_scaled(first, beyond, at);
    second = {};
  }
  const double yaw = at.yaw_deg * kRadPerKeyDeg;
  const Vector3d up = Vector3d::UnitZ();
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  MotionState state;
  state.world_from_rig = pose_of(at);
  state.velocity = first.position;
  state.acceleration = second.position;
  const Vector3d forward = state.world_from_rig.rotation * Vector3d::UnitZ();
  // Roll turns about the optical axis, which pitch tilts about the horizontal, which yaw turns.
  const Vector3d level_turn = kRadPerKeyDeg * first.yaw_deg * up;
  const Vector3d axis_turn = level_turn + kRadPerKeyDeg * first.pitch_deg * right;
  state.angular_velocity = axis_turn + kRadPerKeyDeg * first.roll_deg * forward;
  state.angular_acceleration =
      kRadPerKeyDeg *
      (second.yaw_deg * up + second.pitch_deg * right + second.roll_deg * forward +
       first.pitch_deg * level_turn.cross(right) + first.roll_deg * axis_turn.cross(forward));
  return state;
}

}  // namespace waymark

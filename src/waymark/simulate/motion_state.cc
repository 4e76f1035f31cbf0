// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Where a motion is at a moment, and how it moves.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
/// Of differences in time, s: their errors are 1e-8 of what is differentiated, and rounding's
/// 1e-7 m/s^2.
constexpr double kTimeStep = 1e-4;

/// At a time; before and after the motion it goes on at the rates of the nearer end.
Rigid3 pose_at(const Motion& motion, double seconds) {
  const double inside = std::clamp(seconds, 0.0, motion.duration_s());
  MotionKey at = motion.key(inside);
  if (inside == seconds) return pose_of(at);
  const double back_s = seconds < inside ? kTimeStep : -kTimeStep;
  const MotionKey before = motion.key(inside + back_s);
  const double steps = (inside - seconds) / back_s;
  at.position += steps * (at.position - before.position);
  at.yaw_deg += steps * (at.yaw_deg - before.yaw_deg);
  at.pitch_deg += steps * (at.pitch_deg - before.pitch_deg);
  at.roll_deg += steps * (at.roll_deg - before.roll_deg);
  return pose_of(at);
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

Rigid3 Motion::world_from_rig(double seconds) const { return pose_of(key(seconds)); }

MotionState Motion::state(double seconds) const {
  const Rigid3 before = pose_at(*this, seconds - kTimeStep);
  const Rigid3 now = pose_at(*this, seconds);
  const Rigid3 after = pose_at(*this, seconds + kTimeStep);
  const Vector3d turn_to = so3_log(now.rotation * before.rotation.conjugate());
  const Vector3d turn_from = so3_log(after.rotation * now.rotation.conjugate());
  constexpr double kSquare = kTimeStep * kTimeStep;
  return {now,
          (after.translation - before.translation) / (2.0 * kTimeStep),
          (after.translation - 2.0 * now.translation + before.translation) / kSquare,
          (turn_to + turn_from) / (2.0 * kTimeStep),
          (turn_from - turn_to) / kSquare};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "waymark/simulate/world.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

TEST(Motion, KeysPointWhereTheySay) {
  const Rigid3 ahead = pose_of({{1.0, 2.0, 3.0}, 0.0, 0.0, 0.0});
  EXPECT_NEAR((ahead * Vector3d::UnitZ() - Vector3d(2.0, 2.0, 3.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((ahead.rotation * Vector3d::UnitX() + Vector3d::UnitY()).norm(), 0.0, 1e-12);
  EXPECT_NEAR((ahead.rotation * Vector3d::UnitY() + Vector3d::UnitZ()).norm(), 0.0, 1e-12);
  const Rigid3 left_up = pose_of({Vector3d::Zero(), 90.0, 30.0, 0.0});
  const Vector3d forward = left_up.rotation * Vector3d::UnitZ();
  EXPECT_NEAR((forward - Vector3d(0.0, std::sqrt(0.75), 0.5)).norm(), 0.0, 1e-12);
  // Rolled clockwise, the right side of the camera points down.
  const Rigid3 rolled = pose_of({Vector3d::Zero(), 0.0, 0.0, 90.0});
  EXPECT_NEAR((rolled.rotation * Vector3d::UnitX() + Vector3d::UnitZ()).norm(), 0.0, 1e-12);
}

struct Bounds {
  double speed = 0.0;
  double acceleration = 0.0;
  double jump = 0.0;  ///< Of the acceleration within a millisecond.
  double turn_deg_per_s = 0.0;
};

/// Of the first minute.
Bounds measure(const Motion& motion) {
  constexpr double kStep = 1e-3;
  const double end = std::min(motion.duration_s(), 60.0) - kStep;
  Bounds bounds;
  Vector3d last_acceleration = Vector3d::Zero();
  for (double t = kStep; t < end; t += kStep) {
    const Rigid3 before = motion.world_from_rig(t - kStep);
    const Rigid3 now = motion.world_from_rig(t);
    const Rigid3 after = motion.world_from_rig(t + kStep);
    const Vector3d velocity = (after.translation - before.translation) / (2.0 * kStep);
    const Vector3d acceleration =
        (after.translation - 2.0 * now.translation + before.translation) / (kStep * kStep);
    const double turn = now.rotation.angularDistance(after.rotation) / kStep;
    bounds.speed = std::max(bounds.speed, velocity.norm());
    bounds.acceleration = std::max(bounds.acceleration, acceleration.norm());
    bounds.turn_deg_per_s = std::max(bounds.turn_deg_per_s, turn * 180.0 / std::numbers::pi);
    if (t > 1.5 * kStep)
      bounds.jump = std::max(bounds.jump, (acceleration - last_acceleration).norm());
    last_acceleration = acceleration;
  }
  return bounds;
}

/// Enough for a walk, or a drive in the street, at a usual speed.
double usual_duration_s(const std::string& world, const std::string& motion) {
  if (motion.starts_with("turns_")) return 20.0;
  const bool is_long = world == "corridor" || world == "shop";
  const double once_s = is_long ? 120.0 : world == "street" ? 16.0 : world == "twins" ? 35.0 : 20.0;
  if (motion == "standing_start") return 5.5 + once_s;
  if (motion == "drive") return 2.5 * once_s;  // It stops, and turns with its way.
  if (motion == "flight") return 2.0 * once_s;
  return motion == "rounds" ? 3.0 * once_s : motion == "thirty_rounds" ? 30.0 * once_s : once_s;
}

/// With what a hand sways.
double most_deg_per_s(const std::string& motion) {
  if (motion.starts_with("turns_")) return std::stod(motion.substr(6)) + 15.0;
  return motion == "fast_turn" || motion == "shaken" ? 250.0 : 110.0;
}

TEST(Motion, IsSmooth) {
  for (const std::string& world : world_names()) {
    const bool is_street = world == "street";
    for (const std::string& name : motion_names()) {
      SCOPED_TRACE(world + " " + name);
      const Bounds bounds = measure(make_motion(world, name, usual_duration_s(world, name)));
      EXPECT_LT(bounds.speed, is_street ? 12.0 : 3.0);
      EXPECT_LT(bounds.acceleration, is_street ? 16.0 : 5.0);
      EXPECT_LT(bounds.jump, 0.1);
      EXPECT_LT(bounds.turn_deg_per_s, most_deg_per_s(name));
      if (name.starts_with("turns_")) {
        EXPECT_GT(bounds.turn_deg_per_s, std::stod(name.substr(6)));
      }
    }
  }
}

TEST(Motion, DerivativesAreThoseOfThePose) {
  for (const std::string& name : motion_names()) {
    SCOPED_TRACE(name);
    const Motion motion = make_motion("room", name, usual_duration_s("room", name));
    constexpr double kStep = 1e-4;
    for (double t = 0.511; t < 19.5; t += 0.37) {
      const MotionState before = motion.state(t - kStep);
      const MotionState now = motion.state(t);
      const MotionState after = motion.state(t + kStep);
      const auto slope = [&](auto member) {
        return Vector3d((after.*member - before.*member) / (2.0 * kStep));
      };
      const Vector3d velocity =
          (after.world_from_rig.translation - before.world_from_rig.translation) / (2.0 * kStep);
      EXPECT_LT((now.velocity - velocity).norm(), 1e-5);
      EXPECT_LT((now.acceleration - slope(&MotionState::velocity)).norm(), 2e-3);
      const Vector3d turn =
          so3_log(after.world_from_rig.rotation * before.world_from_rig.rotation.conjugate());
      EXPECT_LT((now.angular_velocity - turn / (2.0 * kStep)).norm(), 1e-4);
      EXPECT_LT((now.angular_acceleration - slope(&MotionState::angular_velocity)).norm(), 0.02);
    }
  }
}

TEST(Motion, KeepsClearOfThings) {
  for (const std::string& name : world_names()) {
    const auto world = make_world(name, 1);
    for (const std::string& motion_name : motion_names()) {
      SCOPED_TRACE(name + " " + motion_name);
      const Motion motion = make_motion(name, motion_name, 20.0);
      double nearest = std::numeric_limits<double>::infinity();
      for (double t = 0.0; t < 20.0; t += 0.4) {
        const Vector3d eye = motion.world_from_rig(t).translation;
        for (int i = 0; i < 36; ++i) {
          const double angle = i * std::numbers::pi / 18.0;
          const Vector3d direction(std::cos(angle), std::sin(angle), -0.2);
          const auto hit = world->intersect(eye, direction);
          if (hit) nearest = std::min(nearest, hit->hit.distance);
        }
      }
      EXPECT_GT(nearest, 0.35);
      EXPECT_LT(nearest, 30.0) << "something is there";
    }
  }
}

TEST(Motion, LoopsComeBack) {
  for (const std::string& world : world_names()) {
    const Motion motion = make_motion(world, "loop", 20.0);
    const Vector3d end = motion.world_from_rig(19.9).translation;
    double nearest = std::numeric_limits<double>::infinity();
    for (double t = 0.0; t < 5.0; t += 0.02) {
      nearest = std::min(nearest, (motion.world_from_rig(t).translation - end).norm());
    }
    EXPECT_LT(nearest, 0.5) << world;
  }
}

TEST(Motion, RoundsPassThreeTimes) {
  for (const std::string& world : world_names()) {
    const Motion motion = make_motion(world, "rounds", 60.0);
    // Three rounds and a bit on: a round takes a little less than a third of the time.
    const Rigid3 first = motion.world_from_rig(10.0);
    const double metres_per_s =
        (motion.world_from_rig(10.1).translation - first.translation).norm() / 0.1;
    std::vector<double> passes_s;
    bool was_near = false;
    for (double t = 0.0; t < 60.0; t += 0.02) {
      const Rigid3 now = motion.world_from_rig(t);
      const double ahead =
          (now.rotation * Vector3d::UnitZ()).dot(first.rotation * Vector3d::UnitZ());
      const bool is_near =
          (now.translation - first.translation).norm() < 1.0 * metres_per_s && ahead > 0.3;
      if (is_near && !was_near) passes_s.push_back(t);
      was_near = is_near;
    }
    EXPECT_EQ(passes_s.size(), 3u) << world;
  }
}

TEST(Motion, ThirtyRoundsAreTheSameButForTheSway) {
  for (const std::string& world : world_names()) {
    constexpr double kRoundS = 20.0;
    const Motion motion = make_motion(world, "thirty_rounds", 30.0 * kRoundS);
    for (double t = 0.0; t < kRoundS; t += 0.5) {
      const Rigid3 first = motion.world_from_rig(t);
      const Rigid3 last = motion.world_from_rig(t + 29.0 * kRoundS);
      EXPECT_LT((first.translation - last.translation).norm(), 0.2) << world;
      EXPECT_LT(first.rotation.angularDistance(last.rotation), 0.1) << world;
    }
  }
}

TEST(Motion, StillStandsAndRotateTurnsOnTheSpot) {
  const Motion still = make_motion("room", "still", 3.0);
  const Motion rotate = make_motion("room", "rotate", 3.0);
  const Rigid3 start = still.world_from_rig(0.0);
  for (double t = 0.0; t <= 3.0; t += 0.1) {
    EXPECT_LT((still.world_from_rig(t).matrix() - start.matrix()).norm(), 1e-12);
    EXPECT_LT((rotate.world_from_rig(t).translation - start.translation).norm(), 1e-12);
  }
  EXPECT_GT(rotate.world_from_rig(1.5).rotation.angularDistance(start.rotation), 2.0);
}

}  // namespace
}  // namespace waymark

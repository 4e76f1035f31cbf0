// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

TEST(Ride, DrivesWhereItLooksAndStops) {
  for (const char* world : {"street", "room", "hall"}) {
    SCOPED_TRACE(world);
    const Motion motion = make_motion(world, "drive", 30.0);
    double fastest = 0.0;
    double at_rest_s = 0.0;
    for (double t = 0.5; t < 29.5; t += 0.01) {
      const MotionState state = motion.state(t);
      const double speed = state.velocity.norm();
      fastest = std::max(fastest, speed);
      if (speed < 1e-6) at_rest_s += 0.01;
      if (speed < 0.2) continue;
      const Vector3d ahead = state.world_from_rig.rotation * Vector3d::UnitZ();
      const Vector3d aside(-ahead.y(), ahead.x(), 0.0);
      // The suspension turns it by up to 0.2 degrees, and the corners of keys by as much.
      EXPECT_LT(std::abs(aside.normalized().dot(state.velocity)), 0.008 * speed) << t;
      EXPECT_LT(std::abs(ahead.z()), 0.008);
    }
    EXPECT_NEAR(at_rest_s, 2.0 * 0.1 * 30.0, 0.5);
    EXPECT_LT(motion.state(9.0).velocity.norm(), 1e-9);
    // At full speed for most of the rest, slower on the rounded corners.
    double mean = 0.0;
    for (double t = 13.0; t < 17.0; t += 0.1) mean += motion.state(t).velocity.norm() / 40.0;
    EXPECT_GT(mean, 0.8 * fastest);
  }
}

TEST(Ride, FliesWithItsThrustUpwards) {
  double steepest = 0.0;
  for (const char* world : {"street", "room", "hall"}) {
    SCOPED_TRACE(world);
    const Motion motion = make_motion(world, "flight", 16.0);
    for (double t = 0.2; t < 15.8; t += 0.05) {
      const MotionState state = motion.state(t);
      const Vector3d thrust = state.acceleration + kStandardGravity * Vector3d::UnitZ();
      const Vector3d up = state.world_from_rig.rotation * -Vector3d::UnitY();
      // But for the gusts of 0.8 degrees and 2 cm.
      EXPECT_LT(std::acos(std::min(1.0, thrust.normalized().dot(up))), 0.1) << t;
      steepest = std::max(steepest, std::acos(std::min(1.0, up.z())));
    }
  }
  EXPECT_GT(steepest, 0.4);
}

TEST(Ride, RestsBeforeItGoes) {
  const Motion motion = make_motion("apartment", "standing_start", 25.0);
  const Rigid3 start = motion.world_from_rig(0.0);
  for (double t = 0.0; t < 4.9; t += 0.05) {
    EXPECT_LT((motion.world_from_rig(t).matrix() - start.matrix()).norm(), 1e-9);
    EXPECT_LT(motion.state(t).acceleration.norm(), 1e-6);
  }
  EXPECT_GT(motion.state(7.0).velocity.norm(), 0.3);
  // As short as one likes, half of it is rest.
  const Motion brief = make_motion("apartment", "standing_start", 1.0);
  EXPECT_LT((brief.world_from_rig(0.4).translation - start.translation).norm(), 1e-9);
}

}  // namespace
}  // namespace waymark

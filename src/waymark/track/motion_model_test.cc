// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

const Vector6d kMotion = (Vector6d() << 0.1, -0.05, 0.2, 0.02, 0.1, -0.03).finished();

TEST(MotionModel, StaysWithoutAVelocity) {
  MotionModel model;
  const Rigid3 pose = Rigid3::exp(kMotion);
  model.update(0, pose);
  EXPECT_EQ(model.predict(1'000'000).matrix(), pose.matrix());
}

TEST(MotionModel, GoesOnInProportionToTime) {
  MotionModel model;
  model.update(0, Rigid3());
  model.update(100, Rigid3::exp(kMotion));
  EXPECT_TRUE(model.predict(200).matrix().isApprox(Rigid3::exp(2.0 * kMotion).matrix(), 1e-12));
  EXPECT_TRUE(model.predict(150).matrix().isApprox(Rigid3::exp(1.5 * kMotion).matrix(), 1e-12));
}

TEST(MotionModel, KeepsTheVelocityWhenTheMapMoves) {
  MotionModel model;
  model.update(0, Rigid3());
  model.update(100, Rigid3::exp(kMotion));
  const Rigid3 moved(Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0});
  model.move_last(moved, 1.0);
  EXPECT_TRUE(model.predict(200).matrix().isApprox((Rigid3::exp(kMotion) * moved).matrix(), 1e-12));
  model.move_last(moved, 2.0);
  Vector6d larger = kMotion;
  larger.head<3>() *= 2.0;
  EXPECT_TRUE(model.predict(200).matrix().isApprox((Rigid3::exp(larger) * moved).matrix(), 1e-12));
}

TEST(MotionModel, TellsHowFastTheRigTurns) {
  MotionModel model;
  const auto turned_by = [](double angle) {
    return Rigid3::exp((Vector6d() << 0.0, 0.0, 0.0, 0.0, angle, 0.0).finished());
  };
  model.update(0, turned_by(0.0));
  EXPECT_EQ(model.mean_motion(), RigMotion{});
  model.update(100'000'000, turned_by(0.1));
  EXPECT_FLOAT_EQ(model.mean_motion().turn_rad_s.y(), 1.0f);
  EXPECT_FLOAT_EQ(model.last_motion().turn_rad_s.y(), 1.0f);
  // By now it is an angle of 10 t^2, which is a turn of 20 t.
  model.update(200'000'000, turned_by(0.4));
  EXPECT_NEAR(model.mean_motion().turn_rad_s.y(), 3.0f, 1e-5f);
  EXPECT_NEAR(model.last_motion().turn_rad_s.y(), 4.0f, 1e-5f);
}

TEST(MotionModel, TurnsAsAGyroscopeSaysWhileTheWayGoesOn) {
  MotionModel model;
  model.update(0, Rigid3(so3_exp({0.0, 0.1, 0.0}), {1.0, 0.0, 0.0}));
  model.update(100, Rigid3::exp(kMotion));
  const Eigen::Quaterniond turn = so3_exp({0.3, 0.0, -0.1});
  const Rigid3 predicted = model.predict(200, turn);
  EXPECT_TRUE(predicted.rotation.isApprox(turn * model.pose().rotation, 1e-12));
  EXPECT_TRUE(predicted.origin_in_source().isApprox(model.predict(200).origin_in_source(), 1e-12));
}

TEST(MotionModel, ForgetsOnReset) {
  MotionModel model;
  model.update(0, Rigid3());
  model.update(100, Rigid3::exp(kMotion));
  model.reset();
  const Rigid3 pose = Rigid3::exp(3.0 * kMotion);
  model.update(200, pose);
  EXPECT_EQ(model.predict(300).matrix(), pose.matrix());
}

}  // namespace
}  // namespace waymark

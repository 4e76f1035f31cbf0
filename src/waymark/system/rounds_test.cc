// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Round after round over the same ground: what a session holds must follow the ground, not the way.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "waymark/system/testing/point_session.h"

namespace waymark {
namespace {

constexpr int kFramesPerRound = 150;
constexpr int kNumRounds = 10;
constexpr int kSettledRounds = 3;

/// Walls around a place, which one looks at from a circle inside.
PointCloud ring_of_walls() {
  PointCloud cloud = scatter_in({-6.0, -2.0, -6.0}, {6.0, 2.0, 6.0}, 2600, 3.0, 3);
  std::erase_if(cloud.landmarks, [](const PointLandmark& landmark) {
    return std::hypot(landmark.position.x(), landmark.position.z()) < 4.0;
  });
  return cloud;
}

Rigid3 on_circle(int frame) {
  const double angle = 2.0 * std::numbers::pi * frame / kFramesPerRound;
  return make_test_pose({2.0 * std::sin(angle), 0.0, 2.0 * std::cos(angle)}, {0.0, angle, 0.0});
}

/// What a session holds.
struct Holding {
  double bytes = 0.0;
  double keyframes = 0.0;
  double landmarks = 0.0;
};

class Rounds : public ::testing::TestWithParam<int> {};

TEST_P(Rounds, NothingGrowsOnceAllIsSeen) {
  PointSession session(GetParam(), ring_of_walls());
  Holding settled, now;
  for (int round = 1; round <= kNumRounds; ++round) {
    int num_tracked = 0;
    for (int i = 0; i < kFramesPerRound; ++i) {
      session.look_from(on_circle(i), 1);
      num_tracked += session.track().state == FrameState::kTracked;
    }
    EXPECT_TRUE(round == 1 || num_tracked == kFramesPerRound) << "round " << round;
    now = {static_cast<double>(bytes_in_use()),
           static_cast<double>(session.map().keyframes().size()),
           static_cast<double>(session.map().landmarks().size())};
    if (round == kSettledRounds) settled = now;
  }
  EXPECT_EQ(session.map().broken_invariants(), "");
  EXPECT_LE(now.bytes, 1.03 * settled.bytes);
  // Of few: noise decides on some.
  EXPECT_LE(now.keyframes, 1.1 * settled.keyframes);
  EXPECT_LE(now.landmarks, 1.1 * settled.landmarks);
}

INSTANTIATE_TEST_SUITE_P(Setups, Rounds, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

}  // namespace
}  // namespace waymark

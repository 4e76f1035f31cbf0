// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A camera that stands still for long: what a session holds must not grow with time.
#include <gtest/gtest.h>

#include "waymark/system/testing/point_session.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumRestingFrames = 10000;
constexpr int kNumRestingViews = 16;

/// A pose near the origin.
Rigid3 beside(double x) { return make_test_pose({x, 0.0, 0.0}, Eigen::Vector3d::Zero()); }

/// A session that has moved sideways until there is a map and a pose in it, and then stands still.
PointSession resting_session(int num_cameras) {
  PointSession session(num_cameras, scatter_in({-3.0, -2.0, 2.0}, {4.0, 2.0, 5.0}, 700, 3.0, 3));
  for (int i = 0; i < 30; ++i) {
    session.look_from(beside(0.02 * i), 1);
    session.track();
  }
  session.look_from(beside(0.02 * 29), kNumRestingViews);
  return session;
}

class AtRest : public ::testing::TestWithParam<int> {};

TEST_P(AtRest, NothingGrowsWithTime) {
  PointSession session = resting_session(GetParam());
  ASSERT_GT(session.map().keyframes().size(), 0u);
  std::size_t bytes_early = 0, keyframes_early = 0, landmarks_early = 0;
  for (std::uint32_t i = 0; i < kNumRestingFrames; ++i) {
    ASSERT_EQ(session.track().state, FrameState::kTracked) << "frame " << i;
    if (i != kNumRestingFrames / 10) continue;
    bytes_early = bytes_in_use();
    keyframes_early = session.map().keyframes().size();
    landmarks_early = session.map().landmarks().size();
  }
  EXPECT_EQ(session.map().keyframes().size(), keyframes_early);
  EXPECT_EQ(session.map().landmarks().size(), landmarks_early);
  EXPECT_LE(keyframes_early, 6u);
  // What is counted between keyframes has room for a while: much less than what frames hold.
  EXPECT_LT(bytes_in_use(), bytes_early + (std::size_t{4} << 20));
}

/// What the tracker counted meanwhile arrives with the next keyframe: each landmark once.
TEST_P(AtRest, VisibilityIsCountedOncePerLandmark) {
  PointSession session = resting_session(GetParam());
  constexpr std::uint32_t kRest = 500;
  for (std::uint32_t i = 0; i < kRest; ++i) session.track();
  const std::size_t num_landmarks = session.map().landmarks().end_id().value;
  for (int i = 0; i < 200; ++i) {
    session.look_from(beside(0.58 + 0.02 * i), 1);
    const Tracked outcome = session.track();
    if (!outcome.message) continue;
    const auto& visibility = std::get<NewKeyframe>(*outcome.message).visibility;
    ASSERT_FALSE(visibility.empty());
    EXPECT_LE(visibility.size(), num_landmarks);
    std::uint32_t most = 0;
    for (const LandmarkVisibility& seen : visibility) {
      EXPECT_LE(seen.num_found, kRest + 1 + static_cast<std::uint32_t>(i));
      most = std::max(most, seen.num_visible);
    }
    EXPECT_GT(most, kRest / 2);
    return;
  }
  FAIL() << "no keyframe";
}

/// A box of points that somebody turns before a wall of them.
PointCloud turned_box(double turn_rad) {
  return with_box(scatter_in({-4.0, -3.0, 5.0}, {5.0, 3.0, 5.5}, 300, 4.0, 3),
                  scatter_in({-0.9, -0.9, -0.9}, {0.9, 0.9, 0.9}, 100, 3.0, 4),
                  make_test_pose({0.8 + turn_rad, 0.3, 3.0}, {0.0, turn_rad, 0.5 * turn_rad}));
}

TEST_P(AtRest, StaysWhateverMovesBeforeIt) {
  PointSession session(GetParam(), turned_box(0.0));
  Rigid3 rest;
  for (int i = 0; i < 30; ++i) {
    session.look_from(beside(0.02 * i), 1);
    rest = session.track().world_from_rig.value_or(Rigid3{});
  }
  const double distance = rest.translation.norm() / 0.58 * 5.0;  // Of the wall.
  for (int i = 0; i < 100; ++i) {
    session.show(turned_box(0.02 * i));
    session.look_from(beside(0.58), 1);
    const Tracked outcome = session.track();
    ASSERT_TRUE(outcome.world_from_rig) << i;
    // The first frames of the box in motion pull a little, while it could be noise.
    EXPECT_LT((outcome.world_from_rig->translation - rest.translation).norm(), 0.04 * distance);
  }
}

INSTANTIATE_TEST_SUITE_P(Setups, AtRest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A camera without scale that sees nothing for a while, and then something else: both parts of the
// map have one unit of length.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "waymark/system/test_point_session.h"

namespace waymark {
namespace {

constexpr double kStep = 0.03;        ///< From frame to frame.
constexpr std::uint32_t kBlack = 40;  ///< Frames from here on show nothing, then the rest.
constexpr std::uint32_t kAfter = 60;
constexpr std::uint32_t kEnd = 100;

/// It waits while it sees nothing.
double position_at(std::uint32_t frame, double speed_after) {
  if (frame < kAfter) return kStep * std::min(frame, kBlack);
  return kStep * (kBlack + speed_after * (frame - kAfter));
}

PointCloud points(std::uint64_t seed) {
  return scatter_in({-4.0, -2.0, 2.0}, {7.0, 2.0, 5.0}, 1100, 3.0, seed);
}

/// Other points than before, but for some of those that both parts see.
PointCloud points_after(std::size_t num_same) {
  PointCloud cloud = points(8);
  for (const PointLandmark& point : points(3).landmarks) {
    const Eigen::Vector3d& at = point.position;
    if (num_same == 0 || at.x() < 1.0 || at.x() > 2.0) continue;
    cloud.landmarks.push_back(point);
    --num_same;
  }
  return cloud;
}

PointSession lost_on_the_way(std::size_t num_same, double speed_after) {
  PointSession session(1, points(3));
  for (std::uint32_t i = 0; i < kEnd; ++i) {
    if (i == kBlack) session.show(scatter_in({-4.0, -2.0, -5.0}, {7.0, 2.0, -2.0}, 10, 3.0, 3));
    if (i == kAfter) session.show(points_after(num_same));
    const double x = position_at(i, speed_after);
    session.look_from(make_test_pose({x, 0.0, 0.0}, Eigen::Vector3d::Zero()), 1);
    session.track();
  }
  return session;
}

/// Of a part of the map, in metres.
double unit_m(const Map& map, SubmapId submap, double speed_after) {
  std::vector<const Keyframe*> keyframes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap == submap) keyframes.push_back(&keyframe);
  });
  const Keyframe& first = *keyframes.front();
  const Keyframe& last = *keyframes.back();
  const double moved_m =
      position_at(last.frame.value, speed_after) - position_at(first.frame.value, speed_after);
  return moved_m /
         (last.rig_from_world.origin_in_source() - first.rig_from_world.origin_in_source()).norm();
}

double ratio_of_units(const PointSession& session, double speed_after) {
  return unit_m(session.map(), SubmapId{1}, speed_after) /
         unit_m(session.map(), SubmapId{0}, speed_after);
}

TEST(KeptScale, FewLandmarksKeepIt) {
  // Twice as fast as before, which the speed would take for a world of half the size.
  const PointSession session = lost_on_the_way(60, 2.0);
  ASSERT_EQ(session.map().submaps().size(), 2u);
  EXPECT_NEAR(ratio_of_units(session, 2.0), 1.0, 0.05);
  const std::vector<KeptScale> kept = session.kept_scales();
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].submap, SubmapId{1});
  EXPECT_EQ(kept[0].before, SubmapId{0});
  EXPECT_GE(kept[0].num_landmarks, 6u);
  EXPECT_LT(kept[0].log_sigma, 0.05);
}

TEST(KeptScale, TheSpeedKeepsItWhereNothingIsSeenAgain) {
  const PointSession session = lost_on_the_way(0, 1.0);
  ASSERT_EQ(session.map().submaps().size(), 2u);
  EXPECT_NEAR(ratio_of_units(session, 1.0), 1.0, 0.05);
  ASSERT_EQ(session.kept_scales().size(), 1u);
  EXPECT_EQ(session.kept_scales()[0].num_landmarks, 0u);
}

}  // namespace
}  // namespace waymark

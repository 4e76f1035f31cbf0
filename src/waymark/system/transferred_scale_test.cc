// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A camera without scale that sees nothing for a while, and then something else: both parts of the
// map have one unit of length.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "waymark/system/testing/point_session.h"

namespace waymark {
namespace {

constexpr double kStep = 0.03;        ///< From frame to frame.
constexpr std::uint32_t kBlack = 40;  ///< Frames from here on show nothing, then the rest.
constexpr std::uint32_t kAfter = 60;
constexpr std::uint32_t kEnd = 100;

/// It waits while it sees nothing.
double position_at(std::uint32_t frame) {
  if (frame < kAfter) return kStep * std::min(frame, kBlack);
  return kStep * (kBlack + frame - kAfter);
}

PointCloud points(std::uint64_t seed) {
  return scatter_in({-4.0, -2.0, 2.0}, {7.0, 2.0, 5.0}, 1100, 3.0, seed);
}

PointSession lost_on_the_way() {
  PointSession session(1, points(3));
  for (std::uint32_t i = 0; i < kEnd; ++i) {
    if (i == kBlack) session.show(scatter_in({-4.0, -2.0, -5.0}, {7.0, 2.0, -2.0}, 10, 3.0, 3));
    if (i == kAfter) session.show(points(8));
    const double x = position_at(i);
    session.look_from(make_test_pose({x, 0.0, 0.0}, Eigen::Vector3d::Zero()), 1);
    session.track();
  }
  return session;
}

/// Of a part of the map, in metres.
double unit_m(const Map& map, SubmapId submap) {
  std::vector<const Keyframe*> keyframes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap == submap) keyframes.push_back(&keyframe);
  });
  const Keyframe& first = *keyframes.front();
  const Keyframe& last = *keyframes.back();
  const double moved_m = position_at(last.frame.value) - position_at(first.frame.value);
  return moved_m /
         (last.rig_from_world.origin_in_source() - first.rig_from_world.origin_in_source()).norm();
}

TEST(TransferredScale, TheSpeedKeepsItWhereNothingIsSeenAgain) {
  const PointSession session = lost_on_the_way();
  const Map& map = session.map();
  ASSERT_EQ(map.submaps().size(), 2u);
  EXPECT_NEAR(unit_m(map, SubmapId{1}) / unit_m(map, SubmapId{0}), 1.0, 0.05);
  const std::vector<TransferredScale> kept = session.kept_scales();
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].submap, SubmapId{1});
  EXPECT_EQ(kept[0].before, SubmapId{0});
}

}  // namespace
}  // namespace waymark

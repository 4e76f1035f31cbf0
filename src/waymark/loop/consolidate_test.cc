// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/loop/close.h"
#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

std::uint32_t num_shared(const Map& map, KeyframeId a, KeyframeId b) {
  for (const CovisibilityEdge& edge : map.covisible(a)) {
    if (edge.keyframe == b) return edge.num_shared;
  }
  return 0;
}

TEST(Overlaps, BecomeNeighboursInTheGraph) {
  LoopScene scene(cloud_all_round(4000), true, Vector7d::Zero());
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  const KeyframeId last{kRound};
  ASSERT_EQ(num_shared(scene.map, last, KeyframeId{0}), 0u);
  const std::size_t num_landmarks = scene.map.landmarks().size();
  ProjectionMatcher matcher;
  DirtyLandmarks dirty;
  fuse_overlaps(scene.map, matcher, dirty);
  EXPECT_GT(num_shared(scene.map, last, KeyframeId{0}), 100u);
  EXPECT_LT(scene.map.landmarks().size(), num_landmarks - 100);
  EXPECT_EQ(scene.map.broken_invariants(), "");
}

TEST(Overlaps, LeaveSubmapsApart) {
  LoopScene scene(cloud_all_round(4000), true, Vector7d::Zero());
  for (int step = 0; step < 5; ++step) scene.add_keyframe(step);
  scene.start_submap(Sim3());
  for (int step = 0; step < 5; ++step) scene.add_keyframe(step);
  const std::size_t num_landmarks = scene.map.landmarks().size();
  ProjectionMatcher matcher;
  DirtyLandmarks dirty;
  fuse_overlaps(scene.map, matcher, dirty);
  EXPECT_EQ(scene.map.landmarks().size(), num_landmarks);
}

}  // namespace
}  // namespace waymark

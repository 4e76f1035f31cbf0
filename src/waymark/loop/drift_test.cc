// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/drift.h"

#include <gtest/gtest.h>

#include "waymark/loop/test_loop.h"

namespace waymark {
namespace {

TEST(DriftTest, ShortestWayGoesAlongTheGraph) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  for (int step = 0; step < kRound / 2; ++step) scene.add_keyframe(step);
  const auto way = shortest_way(scene.map, KeyframeId{kRound / 2 - 1}, KeyframeId{0});
  ASSERT_TRUE(way);
  // Between the chord and the arc of nearly half a round.
  EXPECT_GT(way->length, 2.2 * LoopScene::kRadius);
  EXPECT_LT(way->length, std::numbers::pi * LoopScene::kRadius);
  EXPECT_LT(way->num_steps, kRound / 2 - 1);
  const double part = 0.3 * way->length;
  const auto begun = shortest_way(scene.map, KeyframeId{kRound / 2 - 1}, KeyframeId{0}, part);
  ASSERT_TRUE(begun);
  EXPECT_GE(begun->length, part);
  EXPECT_LT(begun->length, 0.6 * way->length);
  scene.start_submap(Sim3());
  const KeyframeId elsewhere = scene.add_keyframe(0);
  EXPECT_FALSE(shortest_way(scene.map, elsewhere, KeyframeId{0}));
}

TEST(DriftTest, ImpliedDriftIsTheDrift) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.0, 0.1, 0.2));
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  Revisit revisit;
  revisit.query = KeyframeId{kRound};
  revisit.match = KeyframeId{0};
  revisit.query_from_match = scene.true_motion(kRound, 0);
  const ImpliedDrift drift = implied_drift(scene.map, revisit);
  EXPECT_NEAR(drift.angle_rad, 0.1, 1e-9);
  EXPECT_NEAR(std::abs(drift.log_scale), 0.2, 1e-9);
  EXPECT_TRUE(is_plausible_loop(scene.map, revisit));
}

TEST(DriftTest, IsPlausibleForItsWayOnly) {
  LoopScene scene(cloud_all_round(kNumPoints), true, Vector7d::Zero());
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  Revisit revisit;
  revisit.query = KeyframeId{kRound};
  revisit.match = KeyframeId{0};
  const double way = shortest_way(scene.map, revisit.query, revisit.match)->length;
  revisit.query_from_match.translation = {0.03 * way, 0.0, 0.0};
  EXPECT_TRUE(is_plausible_loop(scene.map, revisit));
  revisit.query_from_match.translation = {0.08 * way, 0.0, 0.0};
  EXPECT_FALSE(is_plausible_loop(scene.map, revisit));
  revisit.match = KeyframeId{kRound - 1};  // A step of 0.6 does not allow what the round does.
  revisit.query_from_match =
      Sim3(LoopScene::true_pose(kRound).inverse() * LoopScene::true_pose(kRound - 1));
  EXPECT_TRUE(is_plausible_loop(scene.map, revisit));
  revisit.query_from_match.translation.x() += 0.03 * way;
  EXPECT_FALSE(is_plausible_loop(scene.map, revisit));
}

}  // namespace
}  // namespace waymark

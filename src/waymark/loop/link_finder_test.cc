// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/link_finder.h"

#include <gtest/gtest.h>

#include "waymark/loop/test_loop.h"

namespace waymark {
namespace {

/// A walk past its beginning, none of whose landmarks it knows again.
LoopScene walk_round(bool is_metric, const Vector7d& drift) {
  LoopScene scene(cloud_all_round(kNumPoints), is_metric, drift);
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  return scene;
}

class LinkFinderTest : public ::testing::TestWithParam<bool> {};

TEST_P(LinkFinderTest, FindsWhatLiesBesideThePlace) {
  const bool is_metric = GetParam();
  const double log_scale = is_metric ? 0.0 : 0.05;
  const LoopScene scene = walk_round(is_metric, drift_of(0.1, 0.01, log_scale));
  LinkFinder finder(scene.rig, 1);
  const auto link = finder.find(scene.map, KeyframeId{kRound});
  ASSERT_TRUE(link);
  EXPECT_LT(link->match.value, 3u);
  EXPECT_GT(link->num_inliers, 100u);
  EXPECT_GT(link->pairs.size(), 50u);
  const int match_step = scene.steps[link->match.value];
  const Rigid3 truth = LoopScene::true_pose(kRound).inverse() * LoopScene::true_pose(match_step);
  const double units = scene.map_from_world(kRound).scale;
  EXPECT_LT((link->query_from_match.translation - units * truth.translation).norm(), 0.1);
  EXPECT_LT(link->query_from_match.rotation.angularDistance(truth.rotation), 0.01);
  EXPECT_NEAR(std::log(link->query_from_match.scale), log_scale, 0.01);
}

TEST_P(LinkFinderTest, HasNothingToSayOfWhatIsKnown) {
  const LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  LinkFinder finder(scene.rig, 1);
  EXPECT_FALSE(finder.find(scene.map, KeyframeId{kRound / 2}));
}

TEST_P(LinkFinderTest, RefusesAPlaceThatLooksDifferent) {
  LoopScene scene(cloud_all_round(kNumPoints), GetParam(), Vector7d::Zero());
  for (int step = 0; step < kRound / 2; ++step) scene.add_keyframe(step);
  PointCloud other = scatter_in({-11.0, -2.5, -11.0}, {11.0, 2.5, 11.0}, kNumPoints, 4.5, 77);
  scene.cloud = std::move(other);
  for (int step = kRound / 2; step <= kRound; ++step) scene.add_keyframe(step);
  LinkFinder finder(scene.rig, 1);
  EXPECT_FALSE(finder.find(scene.map, KeyframeId{kRound}));
}

TEST_P(LinkFinderTest, LeavesKeyframesOfOtherRigsAlone) {
  const LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  LinkFinder finder(make_test_rig(1), 1);
  EXPECT_FALSE(finder.find(scene.map, KeyframeId{kRound}));
}

TEST_P(LinkFinderTest, KnowsTheSameRigOfAnotherSession) {
  const LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  LinkFinder finder(std::make_shared<const Rig>(*scene.rig), 1);
  EXPECT_TRUE(finder.find(scene.map, KeyframeId{kRound}));
}

INSTANTIATE_TEST_SUITE_P(Maps, LinkFinderTest, ::testing::Bool(), [](const auto& info) {
  return info.param ? "metric" : "mono";
});

}  // namespace
}  // namespace waymark

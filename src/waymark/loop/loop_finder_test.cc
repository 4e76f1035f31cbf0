// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_finder.h"

#include <gtest/gtest.h>

#include "waymark/loop/drift.h"
#include "waymark/loop/test_loop.h"

namespace waymark {
namespace {

/// The true relative pose of two steps, in the units that the map has at the second.
Sim3 true_motion(const LoopScene& scene, int query_step, int match_step) {
  const Rigid3 relative =
      LoopScene::true_pose(query_step).inverse() * LoopScene::true_pose(match_step);
  const double query_scale = scene.map_from_world(query_step).scale;
  const double match_scale = scene.map_from_world(match_step).scale;
  return {relative.rotation, query_scale * relative.translation, query_scale / match_scale};
}

struct Walk {
  int num_found = 0;
  int first_step = -1;
  std::optional<Revisit> first;
};

/// Adds keyframes for the steps and looks for loops at each.
Walk walk(LoopScene& scene, LoopFinder& finder, int from_step, int to_step) {
  Walk result;
  for (int step = from_step; step < to_step; ++step) {
    const KeyframeId id = scene.add_keyframe(step);
    const std::optional<Revisit> revisit = finder.find(scene.map, scene.places, id);
    if (!revisit) continue;
    if (++result.num_found > 1) continue;
    result.first_step = step;
    result.first = revisit;
  }
  return result;
}

void expect_true(const LoopScene& scene, const Revisit& revisit) {
  const int query_step = scene.steps[revisit.query.value];
  const int match_step = scene.steps[revisit.match.value];
  const Sim3 truth = true_motion(scene, query_step, match_step);
  const Sim3 error = revisit.query_from_match * truth.inverse();
  // Lengths are in the units of the query, in which things are some 5 away. Landmarks drift while
  // they are seen.
  EXPECT_LT(error.translation.norm(), 0.1);
  EXPECT_LT(Eigen::AngleAxisd(error.rotation).angle(), 0.01);
  EXPECT_NEAR(std::log(error.scale), 0.0, 0.01);
}

TEST(LoopFinderTest, FindsTheWayBackDespiteDriftOfTheScale) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.5, 0.1, std::log(1.3)));
  LoopFinder finder(scene.rig, 1);
  const Walk result = walk(scene, finder, 0, kRound + 4);
  ASSERT_TRUE(result.first);
  EXPECT_GE(result.first_step, kRound - 6) << "earlier no place is seen again";
  EXPECT_LE(result.first_step, kRound + 1);
  EXPECT_EQ(result.num_found, kRound + 4 - result.first_step) << "and from then on each time";
  expect_true(scene, *result.first);
  EXPECT_GE(result.first->pairs.size(), 25u);
}

TEST(LoopFinderTest, KeepsTheScaleOfMetricMaps) {
  LoopScene scene(cloud_all_round(kNumPoints), true, drift_of(0.3, 0.05, 0.0));
  LoopFinder finder(scene.rig, 1);
  const Walk result = walk(scene, finder, 0, kRound + 3);
  ASSERT_TRUE(result.first);
  EXPECT_EQ(result.first->query_from_match.scale, 1.0);
  expect_true(scene, *result.first);
}

TEST(LoopFinderTest, NamesLandmarksThatAreTheSame) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopFinder finder(scene.rig, 1);
  const Walk result = walk(scene, finder, 0, kRound + 2);
  ASSERT_TRUE(result.first);
  int num_wrong = 0;
  for (const Revisit::Pair& pair : result.first->pairs) {
    const Eigen::Vector3d& a = scene.map.landmarks().at(pair.of_query).position_in_world;
    const Eigen::Vector3d& b = scene.map.landmarks().at(pair.of_match).position_in_world;
    num_wrong += (a - b).norm() > 1e-9;  // Without drift they coincide.
  }
  EXPECT_EQ(num_wrong, 0);
}

TEST(LoopFinderTest, RefusesATwinAsTheMapCannotHaveDriftedSoFar) {
  LoopScene scene(cloud_with_twins(kNumPoints), false, drift_of(0.1, 0.02, 0.02));
  LoopFinder finder(scene.rig, 1);
  RevisitVerifier verifier(scene.rig, 1);
  const Walk result = walk(scene, finder, 0, kRound - 5);
  EXPECT_EQ(result.num_found, 0) << "no place was seen again, but half a round was seen twice";
  // By its looks and geometry it would have been one.
  const KeyframeId query{kRound / 2 + 3};
  const std::vector<KeyframeId> candidates = find_candidates(scene.map, scene.places, query, 3);
  ASSERT_FALSE(candidates.empty());
  const auto evidence = verifier.examine(scene.map, query, candidates.front());
  ASSERT_TRUE(evidence);
  EXPECT_GE(evidence->revisit.num_inliers, 100u);
  EXPECT_GE(evidence->in_query.share(), 0.5);
  EXPECT_FALSE(is_plausible_loop(scene.map, evidence->revisit));
  EXPECT_NEAR(implied_drift(scene.map, evidence->revisit).distance, 2.0 * LoopScene::kRadius, 0.5);
}

TEST(LoopFinderTest, FindsThePlaceInAnotherSubmapOfAnotherScale) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopFinder finder(scene.rig, 1);
  EXPECT_EQ(walk(scene, finder, 0, 12).num_found, 0);
  Vector7d other_frame;
  other_frame << 3.0, 1.0, -2.0, 0.3, -0.5, 0.2, std::log(0.4);
  scene.start_submap(Sim3::exp(other_frame));
  const Walk result = walk(scene, finder, 4, 12);
  ASSERT_TRUE(result.first);
  EXPECT_LE(result.first_step, 8);
  const Sim3& found = result.first->query_from_match;
  EXPECT_NEAR(found.scale, 0.4, 0.004);
  EXPECT_EQ(scene.map.keyframes().at(result.first->match).submap, SubmapId{0});
}

TEST(LoopFinderTest, WantsWitnessesForAnotherSubmap) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopFinder finder(scene.rig, 1);
  EXPECT_EQ(walk(scene, finder, 0, 12).num_found, 0);
  scene.start_submap(Sim3());
  // The first keyframe of a sub-map has no neighbour that could confirm.
  EXPECT_EQ(walk(scene, finder, 6, 7).num_found, 0);
  EXPECT_EQ(walk(scene, finder, 7, 8).num_found, 0);
}

TEST(LoopFinderTest, JoinsNothingAtAPlaceThatIsThereTwice) {
  LoopScene scene(cloud_with_twins(kNumPoints), false, Vector7d::Zero());
  LoopFinder finder(scene.rig, 1);
  walk(scene, finder, 0, 30);  // The second ten are like the first, in another place.
  scene.start_submap(Sim3());
  EXPECT_EQ(walk(scene, finder, 2, 8).num_found, 0);
}

TEST(LoopFinderTest, SeesNothingWhereNothingIsSeenAgain) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.5, 0.1, 0.1));
  LoopFinder finder(scene.rig, 1);
  EXPECT_EQ(walk(scene, finder, 0, kRound - 8).num_found, 0);
}

TEST(DriftTest, ShortestWayGoesAlongTheGraph) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  for (int step = 0; step < kRound / 2; ++step) scene.add_keyframe(step);
  const auto way = shortest_way(scene.map, KeyframeId{kRound / 2 - 1}, KeyframeId{0});
  ASSERT_TRUE(way);
  // Between the chord and the arc of nearly half a round.
  EXPECT_GT(way->length, 2.2 * LoopScene::kRadius);
  EXPECT_LT(way->length, std::numbers::pi * LoopScene::kRadius);
  EXPECT_LT(way->num_steps, kRound / 2 - 1);
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
  revisit.query_from_match = true_motion(scene, kRound, 0);
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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/verify.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"
#include "waymark/loop/spatial_neighbours.h"
#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

struct Walk {
  int num_found = 0;
  int first_step = -1;
  std::optional<LoopCandidate> first;
};

/// Adds keyframes for the steps and looks for loops at each.
Walk walk(LoopScene& scene, LoopVerifier& verifier, int from_step, int to_step) {
  Walk result;
  for (int step = from_step; step < to_step; ++step) {
    const KeyframeId id = scene.add_keyframe(step);
    const std::optional<LoopCandidate> candidate =
        verifier.verify_alike(scene.map, scene.places, id);
    if (!candidate) continue;
    if (++result.num_found > 1) continue;
    result.first_step = step;
    result.first = candidate;
  }
  return result;
}

void expect_true(const LoopScene& scene, const LoopCandidate& candidate) {
  const int query_step = scene.steps[candidate.query.value];
  const int match_step = scene.steps[candidate.match.value];
  const Sim3 truth = scene.true_motion(query_step, match_step);
  const Sim3 error = candidate.query_from_match * truth.inverse();
  // Lengths are in the units of the query, in which things are some 5 away. Landmarks drift while
  // they are seen.
  EXPECT_LT(error.translation.norm(), 0.1);
  EXPECT_LT(Eigen::AngleAxisd(error.rotation).angle(), 0.01);
  EXPECT_NEAR(std::log(error.scale), 0.0, 0.01);
}

TEST(VerifyAlikeTest, FindsTheWayBackDespiteDriftOfTheScale) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.5, 0.1, std::log(1.3)));
  LoopVerifier verifier(1);
  const Walk result = walk(scene, verifier, 0, kRound + 4);
  ASSERT_TRUE(result.first);
  EXPECT_GE(result.first_step, kRound - 6) << "earlier no place is seen again";
  EXPECT_LE(result.first_step, kRound + 1);
  EXPECT_EQ(result.num_found, kRound + 4 - result.first_step) << "and from then on each time";
  expect_true(scene, *result.first);
  EXPECT_GE(result.first->pairs.size(), 25u);
}

TEST(VerifyAlikeTest, KeepsTheScaleOfMetricMaps) {
  LoopScene scene(cloud_all_round(kNumPoints), true, drift_of(0.3, 0.05, 0.0));
  LoopVerifier verifier(1);
  const Walk result = walk(scene, verifier, 0, kRound + 3);
  ASSERT_TRUE(result.first);
  EXPECT_EQ(result.first->query_from_match.scale, 1.0);
  expect_true(scene, *result.first);
}

TEST(VerifyAlikeTest, NamesLandmarksThatAreTheSame) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopVerifier verifier(1);
  const Walk result = walk(scene, verifier, 0, kRound + 2);
  ASSERT_TRUE(result.first);
  int num_wrong = 0;
  for (const LoopCandidate::Pair& pair : result.first->pairs) {
    const Eigen::Vector3d& a = scene.map.landmarks().at(pair.of_query).position_in_world;
    const Eigen::Vector3d& b = scene.map.landmarks().at(pair.of_match).position_in_world;
    num_wrong += (a - b).norm() > 1e-9;  // Without drift they coincide.
  }
  EXPECT_EQ(num_wrong, 0);
}

TEST(VerifyAlikeTest, RefusesATwinAsTheMapCannotHaveDriftedSoFar) {
  LoopScene scene(cloud_with_twins(kNumPoints), false, drift_of(0.1, 0.02, 0.02));
  LoopVerifier verifier(1);
  CandidateScorer scorer(1);
  const Walk result = walk(scene, verifier, 0, kRound - 5);
  EXPECT_EQ(result.num_found, 0) << "no place was seen again, but half a round was seen twice";
  // By its looks and geometry it would have been one.
  const KeyframeId query{kRound / 2 + 3};
  const std::vector<KeyframeId> candidates = find_alike(scene.map, scene.places, query);
  ASSERT_FALSE(candidates.empty());
  const auto scored = scorer.score(scene.map, query, candidates.front());
  ASSERT_TRUE(scored);
  EXPECT_GE(scored->candidate.num_inliers, 100u);
  EXPECT_GE(scored->in_query.share(), 0.5);
  EXPECT_FALSE(is_plausible_loop(scene.map, scored->candidate));
  EXPECT_NEAR(implied_drift(scene.map, scored->candidate).distance, 2.0 * LoopScene::kRadius, 0.5);
}

TEST(VerifyAlikeTest, FindsThePlaceInAnotherSubmapOfAnotherScale) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopVerifier verifier(1);
  EXPECT_EQ(walk(scene, verifier, 0, 12).num_found, 0);
  Vector7d other_frame;
  other_frame << 3.0, 1.0, -2.0, 0.3, -0.5, 0.2, std::log(0.4);
  scene.start_submap(Sim3::exp(other_frame));
  const Walk result = walk(scene, verifier, 4, 12);
  ASSERT_TRUE(result.first);
  EXPECT_LE(result.first_step, 8);
  const Sim3& found = result.first->query_from_match;
  EXPECT_NEAR(found.scale, 0.4, 0.004);
  EXPECT_EQ(scene.map.keyframes().at(result.first->match).submap, SubmapId{0});
}

TEST(VerifyAlikeTest, WantsConfirmationOfAnotherSubmap) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  LoopVerifier verifier(1);
  EXPECT_EQ(walk(scene, verifier, 0, 12).num_found, 0);
  scene.start_submap(Sim3());
  // The first keyframe of a sub-map has no neighbour that could confirm.
  EXPECT_EQ(walk(scene, verifier, 6, 7).num_found, 0);
  EXPECT_EQ(walk(scene, verifier, 7, 8).num_found, 0);
}

TEST(VerifyAlikeTest, JoinsNothingAtAPlaceThatIsThereTwice) {
  LoopScene scene(cloud_with_twins(kNumPoints), false, Vector7d::Zero());
  LoopVerifier verifier(1);
  walk(scene, verifier, 0, 30);  // The second ten are like the first, in another place.
  scene.start_submap(Sim3());
  EXPECT_EQ(walk(scene, verifier, 2, 8).num_found, 0);
}

TEST(VerifyAlikeTest, JoinsAtAPlaceThatAnotherOneFaintlyResembles) {
  LoopScene scene(cloud_with_faint_twins(kNumPoints), true, Vector7d::Zero());
  LoopVerifier verifier(1);
  walk(scene, verifier, 0, 12);
  scene.start_submap(Sim3());
  EXPECT_EQ(walk(scene, verifier, 18, 30).num_found, 0) << "a fifth of what is there is the same";
  const Walk result = walk(scene, verifier, 30, kRound + 10);
  EXPECT_GE(result.num_found, 8);
  EXPECT_EQ(scene.map.keyframes().at(result.first->match).submap, SubmapId{0});
}

TEST(FindAlikeTest, LeavesRoomForOtherSubmapsWhereMuchOfItsOwnLooksAlike) {
  LoopScene scene(cloud_of_equal_stretches(kNumPoints, 10), true, Vector7d::Zero());
  for (int step = 0; step < kRound; ++step) scene.add_keyframe(step);
  // The other one has a third of it.
  std::vector<PointLandmark>& points = scene.cloud.landmarks;
  points.resize(points.size() / 30);
  scene.start_submap(Sim3());
  for (int step = 0; step < 4; ++step) scene.add_keyframe(step);
  const auto found = find_alike(scene.map, scene.places, KeyframeId{kRound - 1});
  const auto num_own =
      std::ranges::count_if(found, [](KeyframeId id) { return id.value < kRound; });
  EXPECT_EQ(num_own, 4);
  EXPECT_GT(found.size(), 4u);
  EXPECT_LT(found.front().value, std::uint32_t{kRound}) << "best first";
}

TEST(VerifyAlikeTest, FindsThePlaceAmongEqualStretchesThatTheMapIsNearTo) {
  LoopScene scene(cloud_of_equal_stretches(kNumPoints, 10), true, drift_of(0.05, 0.01, 0.0));
  LoopVerifier verifier(1);
  const Walk result = walk(scene, verifier, 0, kRound + 4);
  ASSERT_TRUE(result.first);
  EXPECT_GE(result.first_step, kRound - 6);
  expect_true(scene, *result.first);
}

TEST(VerifyAlikeTest, ClosesNoLoopAmongEqualStretchesIfTheMapMayLieAtAny) {
  // Stretches of 2.5 at a way of 25: were they not equal, the map might have drifted so far.
  const Vector7d drift = drift_of(0.9, 0.1, 0.0);
  LoopScene scene(cloud_of_equal_stretches(kNumPoints, 10), true, drift);
  LoopVerifier verifier(1);
  EXPECT_EQ(walk(scene, verifier, 0, kRound + 4).num_found, 0);
  LoopScene unequal(cloud_all_round(kNumPoints), true, drift);
  EXPECT_GT(walk(unequal, verifier, 0, kRound + 4).num_found, 0);
}

TEST(VerifyAlikeTest, SeesNothingWhereNothingIsSeenAgain) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.5, 0.1, 0.1));
  LoopVerifier verifier(1);
  EXPECT_EQ(walk(scene, verifier, 0, kRound - 8).num_found, 0);
}

/// As the mapper looks for what a closure brought together.
std::optional<LoopCandidate> verify_neighbours_of(LoopVerifier& verifier,
                                                  const LoopScene& scene,
                                                  KeyframeId query) {
  const auto beside = find_spatial_neighbours(scene.map, query, {5, 0.8, 0.7});
  return verifier.verify_spatial_neighbours(scene.map, query, beside);
}

/// A walk past its beginning, none of whose landmarks it knows again.
LoopScene walk_round(bool is_metric, const Vector7d& drift) {
  LoopScene scene(cloud_all_round(kNumPoints), is_metric, drift);
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  return scene;
}

class VerifySpatialNeighboursTest : public ::testing::TestWithParam<bool> {};

TEST_P(VerifySpatialNeighboursTest, FindsWhatLiesBesideThePlace) {
  const bool is_metric = GetParam();
  const double log_scale = is_metric ? 0.0 : 0.05;
  const LoopScene scene = walk_round(is_metric, drift_of(0.1, 0.01, log_scale));
  LoopVerifier verifier(1);
  const auto link = verify_neighbours_of(verifier, scene, KeyframeId{kRound});
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

TEST_P(VerifySpatialNeighboursTest, HasNothingToSayOfWhatIsKnown) {
  const LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  LoopVerifier verifier(1);
  EXPECT_FALSE(verify_neighbours_of(verifier, scene, KeyframeId{kRound / 2}));
}

TEST_P(VerifySpatialNeighboursTest, RefusesAPlaceThatLooksDifferent) {
  LoopScene scene(cloud_all_round(kNumPoints), GetParam(), Vector7d::Zero());
  for (int step = 0; step < kRound / 2; ++step) scene.add_keyframe(step);
  PointCloud other = scatter_in({-11.0, -2.5, -11.0}, {11.0, 2.5, 11.0}, kNumPoints, 4.5, 77);
  scene.cloud = std::move(other);
  for (int step = kRound / 2; step <= kRound; ++step) scene.add_keyframe(step);
  LoopVerifier verifier(1);
  EXPECT_FALSE(verify_neighbours_of(verifier, scene, KeyframeId{kRound}));
}

/// As if another rig had made a keyframe.
void set_rig(KeyframeId id, std::shared_ptr<const Rig> rig, Map& map) {
  auto features = std::make_shared<Features>(*map.keyframes().at(id).features);
  features->rig = std::move(rig);
  map.recompute_keyframe(id, std::move(features));
}

TEST_P(VerifySpatialNeighboursTest, LeavesKeyframesOfOtherRigsAlone) {
  LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  set_rig(KeyframeId{kRound}, make_test_rig(1), scene.map);
  LoopVerifier verifier(1);
  EXPECT_FALSE(verify_neighbours_of(verifier, scene, KeyframeId{kRound}));
}

TEST_P(VerifySpatialNeighboursTest, KnowsTheSameRigOfAnotherSession) {
  LoopScene scene = walk_round(GetParam(), Vector7d::Zero());
  set_rig(KeyframeId{kRound}, std::make_shared<const Rig>(*scene.rig), scene.map);
  LoopVerifier verifier(1);
  EXPECT_TRUE(verify_neighbours_of(verifier, scene, KeyframeId{kRound}));
}

INSTANTIATE_TEST_SUITE_P(Maps,
                         VerifySpatialNeighboursTest,
                         ::testing::Bool(),
                         [](const auto& info) { return info.param ? "metric" : "mono"; });

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/close.h"

#include <gtest/gtest.h>

#include "waymark/loop/find.h"
#include "waymark/loop/loop_pose_graph.h"
#include "waymark/loop/testing/loop.h"
#include "waymark/loop/verify.h"

namespace waymark {
namespace {

/// Walks on until a place is recognised; the scene's last keyframe is the query.
LoopCandidate walk_until_found(LoopScene& scene, int from_step) {
  LoopVerifier verifier(1);
  for (int step = from_step;; ++step) {
    const KeyframeId id = scene.add_keyframe(step);
    if (step < from_step + 4) continue;
    if (const auto found = verifier.verify_alike(scene.map, scene.places, id)) return *found;
  }
}

Vector7d whole_drift(const Eigen::Vector3d& translation,
                     const Eigen::Vector3d& turn,
                     double scale) {
  Vector7d drift;
  drift << translation, turn, std::log(scale);
  return drift;
}

class LoopClosingTest : public ::testing::Test {
 protected:
  void close(LoopScene& scene, const LoopCandidate& candidate) {
    ProjectionMatcher matcher;
    const LoopPoseGraph spread = optimize_loop(scene.map, as_loop(candidate));
    close_loop(scene.map, candidate, spread.correction, matcher, dirty_);
    ASSERT_EQ(scene.map.broken_invariants(), "");
  }

  DirtyLandmarks dirty_;
};

TEST_F(LoopClosingTest, ClosesALoopWithDriftOfTheScale) {
  LoopScene scene(
      cloud_all_round(kNumPoints), false, whole_drift({0.3, 0.1, 0.0}, {0.02, 0.1, -0.02}, 1.3));
  const LoopCandidate candidate = walk_until_found(scene, 0);
  const double error_before = error_of(scene);
  const double residual_before = median_residual_px(scene.map);
  ASSERT_GT(error_before, 0.2);
  close(scene, candidate);
  EXPECT_LT(error_of(scene), 0.25 * error_before);
  EXPECT_LT(median_residual_px(scene.map), 1.2 * residual_before);
  // One unit is as long where the round ends as where it began.
  const Rigid3 measured =
      scene.map.keyframes().at(candidate.query).rig_from_world *
      scene.map.keyframes().at(KeyframeId{candidate.query.value - 5}).rig_from_world.inverse();
  const Rigid3 at_start = scene.map.keyframes().at(KeyframeId{5}).rig_from_world *
                          scene.map.keyframes().at(KeyframeId{0}).rig_from_world.inverse();
  EXPECT_NEAR(measured.translation.norm() / at_start.translation.norm(), 1.0, 0.02);
}

TEST_F(LoopClosingTest, SpreadsTheDriftEvenly) {
  LoopScene scene(cloud_all_round(kNumPoints), false, whole_drift({0, 0, 0}, {0, 0, 0}, 1.3));
  const LoopCandidate candidate = walk_until_found(scene, 0);
  const MapCorrection correction = optimize_loop(scene.map, as_loop(candidate)).correction;
  ASSERT_EQ(correction.keyframes.size(), scene.map.keyframes().size());
  EXPECT_EQ(correction.keyframes.front().scale, 1.0) << "the root stays";
  const double per_step = std::log(1.3) / kRound;
  for (std::size_t i = 1; i < correction.keyframes.size(); ++i) {
    EXPECT_NEAR(std::log(correction.keyframes[i].scale), -per_step * static_cast<double>(i), 0.04);
  }
}

TEST_F(LoopClosingTest, ClosesALoopOfAMetricMapWithoutResizingIt) {
  LoopScene scene(
      cloud_all_round(kNumPoints), true, whole_drift({0.3, 0.1, 0.2}, {0.02, 0.08, -0.02}, 1.0));
  const LoopCandidate candidate = walk_until_found(scene, 0);
  const double error_before = error_of(scene);
  close(scene, candidate);
  EXPECT_LT(error_of(scene), 0.4 * error_before);
  scene.map.keyframes().for_each(
      [](KeyframeId, const Keyframe& keyframe) { EXPECT_EQ(keyframe.applied_scale, 1.0); });
}

TEST_F(LoopClosingTest, FusesWhatIsSeenFromBothSides) {
  LoopScene scene(cloud_all_round(kNumPoints), false, whole_drift({0.3, 0, 0}, {0, 0.1, 0}, 1.1));
  const LoopCandidate candidate = walk_until_found(scene, 0);
  const std::size_t num_before = scene.map.landmarks().size();
  EXPECT_TRUE(scene.map.covisible(candidate.query).back().keyframe.value > 20u);
  close(scene, candidate);
  EXPECT_LE(scene.map.landmarks().size(), num_before - candidate.pairs.size());
  std::uint32_t num_shared = 0;
  for (const CovisibilityEdge& edge : scene.map.covisible(candidate.query)) {
    if (edge.keyframe == candidate.match) num_shared = edge.num_shared;
  }
  EXPECT_GE(num_shared, candidate.pairs.size());
  EXPECT_FALSE(dirty_.empty());
  ASSERT_EQ(scene.map.loop_edges().size(), 1u);
  EXPECT_TRUE(scene.map.has_loop_edge(candidate.query));
  // The place is not found again: the map knows now.
  LoopVerifier verifier(1);
  EXPECT_FALSE(verifier.verify_alike(scene.map, scene.places, candidate.query));
}

TEST_F(LoopClosingTest, KeepsOldLoopsClosed) {
  LoopScene scene(cloud_all_round(kNumPoints), false, whole_drift({0.3, 0, 0}, {0, 0.1, 0}, 1.2));
  close(scene, walk_until_found(scene, 0));
  const double error_before = error_of(scene);
  // The same loop again, measured a little differently.
  const LoopEdge old = scene.map.loop_edges().front();
  LoopCandidate again;
  again.query = old.to;
  again.match = old.from;
  again.query_from_match = Sim3::exp(0.01 * Vector7d::Ones()) * old.to_from_from;
  close(scene, again);
  EXPECT_LT(error_of(scene), 1.5 * error_before + 0.02);
}

TEST(JoinSubmapsTest, MovesTheYoungerToTheOlder) {
  for (const bool is_query_older : {false, true}) {
    LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
    for (int step = 0; step < 12; ++step) scene.add_keyframe(step);
    Vector7d other_frame;
    other_frame << 3.0, 1.0, -2.0, 0.3, -0.5, 0.2, std::log(0.4);
    scene.start_submap(Sim3::exp(other_frame));
    LoopCandidate candidate = walk_until_found(scene, 4);
    if (is_query_older) {
      std::swap(candidate.query, candidate.match);
      candidate.query_from_match = candidate.query_from_match.inverse();
      for (LoopCandidate::Pair& pair : candidate.pairs) std::swap(pair.of_query, pair.of_match);
    }
    ProjectionMatcher matcher;
    DirtyLandmarks dirty;
    const Map& map = scene.map;
    const std::size_t num_landmarks = map.landmarks().size();
    join_submaps(scene.map, scene.places, candidate, matcher, dirty);
    EXPECT_EQ(map.broken_invariants(), "");
    EXPECT_EQ(map.resolve(SubmapId{1}), SubmapId{0});
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      EXPECT_EQ(keyframe.submap, SubmapId{0});
      const Rigid3 truth = LoopScene::true_pose(scene.steps[id.value]).inverse();
      const Rigid3 error = keyframe.rig_from_world * truth.inverse();
      EXPECT_LT(error.translation.norm(), 0.05) << id.value;
      EXPECT_NEAR(keyframe.applied_scale, id.value < 12 ? 1.0 : 2.5, 0.03);
    });
    EXPECT_LT(median_residual_px(map), 1.0);
    EXPECT_LT(map.landmarks().size(), num_landmarks - candidate.pairs.size() / 2);
    const auto found =
        scene.places.find(map.keyframes().at(candidate.match).features->descriptors, {});
    for (const PlaceCandidate& candidate : found) EXPECT_EQ(candidate.submap, SubmapId{0});
  }
}

}  // namespace
}  // namespace waymark

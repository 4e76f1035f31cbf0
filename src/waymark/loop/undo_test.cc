// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/undo.h"

#include <gtest/gtest.h>

#include "waymark/features/hamming.h"
#include "waymark/loop/close.h"
#include "waymark/loop/loop_pose_graph.h"
#include "waymark/loop/odometry.h"
#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

std::size_t num_observations(const Map& map) {
  std::size_t count = 0;
  map.landmarks().for_each(
      [&](LandmarkId, const Landmark& landmark) { count += landmark.observations.size(); });
  return count;
}

/// The last keyframe taken for what it looks like: the place nine stretches before.
LoopCandidate twin_of_last(const Map& map) {
  LoopCandidate lie;
  lie.query = KeyframeId{map.keyframes().end_id().value - 1};
  lie.match = KeyframeId{lie.query.value - 9 * kRound / 10};
  const Keyframe& query = map.keyframes().at(lie.query);
  const Keyframe& match = map.keyframes().at(lie.match);
  for (std::size_t i = 0; i < query.features->num_primary; ++i) {
    for (std::size_t j = 0; j < match.features->num_primary; ++j) {
      constexpr int kMaxDistance = 40;
      const int distance =
          hamming_distance(query.features->descriptors[i], match.features->descriptors[j]);
      const float apart = (query.features->bearings[i] - match.features->bearings[j]).norm();
      if (distance < kMaxDistance && apart < 0.01f && query.landmarks[i].is_valid() &&
          match.landmarks[j].is_valid()) {
        lie.pairs.push_back({query.landmarks[i], match.landmarks[j]});
        break;
      }
    }
  }
  return lie;
}

TEST(UndoLoops, TakesBackPosesAndMerges) {
  for (const bool is_metric : {true, false}) {
    LoopScene scene(cloud_of_equal_stretches(kNumPoints, 10), is_metric, Vector7d::Zero());
    for (int step = 0; step < kRound; ++step) scene.add_keyframe(step);
    Map& map = scene.map;
    const double residual = median_residual_px(map);
    const std::size_t num_before = num_observations(map);
    note_odometry(map);
    const LoopCandidate lie = twin_of_last(map);
    ASSERT_GT(lie.pairs.size(), 30u);
    ProjectionMatcher matcher;
    DirtyLandmarks dirty;
    close_loop(map, lie, optimize_loop(map, as_loop(lie)).correction, matcher, dirty);
    const std::size_t num_merged = map.landmarks().size();
    const LandmarkId end_before = map.landmarks().end_id();
    const std::vector<std::uint8_t> none = {0};
    undo_loops(map, SubmapId{0}, none, {}, dirty);
    EXPECT_EQ(map.broken_invariants(), "");
    EXPECT_TRUE(map.measured_loop_edges().empty());
    EXPECT_GT(map.landmarks().size(), num_merged);
    EXPECT_LT(median_residual_px(map), 1.3 * residual);
    EXPECT_GT(num_observations(map), num_before * 9 / 10);
    map.landmarks().for_each([&](LandmarkId id, const Landmark&) {
      EXPECT_TRUE(id < end_before || dirty.contains(id)) << id.value;
    });
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      const Rigid3 truth = LoopScene::true_pose(scene.steps[id.value]).inverse();
      EXPECT_LT((keyframe.rig_from_world * truth.inverse()).translation.norm(), 0.02) << id.value;
    });
    for (const CovisibilityEdge& edge : map.covisible(lie.query)) {
      EXPECT_GT(edge.keyframe.value + kRound / 4, lie.query.value);
    }
  }
}

}  // namespace
}  // namespace waymark

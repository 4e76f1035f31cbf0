// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/merge_maps.h"

#include <gtest/gtest.h>

#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/loop/testing/loop.h"
#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

/// A map of the steps from one to another, in a frame and units of its own.
std::unique_ptr<LoopScene> walk(int from_step, int to_step, bool is_metric, double scale) {
  auto scene =
      std::make_unique<LoopScene>(cloud_all_round(kNumPoints), is_metric, Vector7d::Zero());
  scene->map = Map();
  scene->start_submap(
      {Eigen::Quaterniond(0.8, 0.1, -0.5, 0.3).normalized(), {3.0, 1.0, -2.0}, scale});
  for (int step = from_step; step < to_step; ++step) scene->add_keyframe(step);
  return scene;
}

/// Root mean square distance of all keyframes from the truth after one similarity.
double error_of(const Map& map, const LoopScene& a, const LoopScene& b) {
  std::vector<Eigen::Vector3d> mapped, truth;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const std::size_t index = id.value;
    const int step = index < a.steps.size() ? a.steps[index] : b.steps[index - a.steps.size()];
    mapped.push_back(keyframe.rig_from_world.origin_in_source());
    truth.push_back(LoopScene::true_pose(step).translation);
  });
  const Sim3 truth_from_map = align_similarity(mapped, truth).value();
  double sum = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    sum += (truth_from_map * mapped[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(mapped.size()));
}

TEST(MapMergerTest, JoinsMapsThatOverlap) {
  const auto a = walk(0, 22, false, 1.0);
  const auto b = walk(kRound + 14, kRound + 34, false, 1.7);
  const Rigid3 root_before = a->map.keyframes().at(KeyframeId{0}).rig_from_world;
  const MergedMaps merged = merge_maps(a->map, b->map, 1);
  ASSERT_EQ(merged.map->broken_invariants(), "");
  EXPECT_EQ(merged.num_joins, 1);
  EXPECT_EQ(merged.map->submaps()[1].joined_into, SubmapId{0});
  EXPECT_EQ(merged.map->keyframes().size(), 42u);
  EXPECT_LT(error_of(*merged.map, *a, *b), 0.05);
  // The frame is that of the first map, and what both saw is there once.
  EXPECT_EQ(merged.map->keyframes().at(KeyframeId{0}).rig_from_world.matrix(),
            root_before.matrix());
  EXPECT_LT(merged.map->landmarks().size(),
            a->map.landmarks().size() + b->map.landmarks().size() - 100);
}

TEST(MapMergerTest, KeepsMapsApartThatDoNotOverlap) {
  const auto a = walk(0, 8, false, 1.0);
  const auto b = walk(20, 28, false, 1.0);
  const MergedMaps merged = merge_maps(a->map, b->map, 1);
  ASSERT_EQ(merged.map->broken_invariants(), "");
  EXPECT_EQ(merged.num_joins, 0);
  EXPECT_EQ(merged.num_loops, 0);
  EXPECT_FALSE(merged.map->submaps()[0].joined_into.is_valid());
  EXPECT_FALSE(merged.map->submaps()[1].joined_into.is_valid());
  b->map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    EXPECT_EQ(merged.map->keyframes().at(KeyframeId{id.value + 8}).rig_from_world.matrix(),
              keyframe.rig_from_world.matrix());
  });
}

TEST(MapMergerTest, DoesNotCompareMetresWithFreeScales) {
  const auto a = walk(0, 12, false, 1.0);
  const auto b = walk(kRound, kRound + 12, true, 1.0);
  EXPECT_EQ(merge_maps(a->map, b->map, 1).num_joins, 0);
}

TEST(MapMergerTest, IsRepeatable) {
  const auto a = walk(0, 12, true, 1.0);
  const auto b = walk(kRound + 6, kRound + 16, true, 1.0);
  const MergedMaps first = merge_maps(a->map, b->map, 1);
  const MergedMaps second = merge_maps(a->map, b->map, 1);
  EXPECT_EQ(first.num_joins, 1);
  first.map->landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_EQ(second.map->landmarks().at(id).position_in_world, landmark.position_in_world);
  });
}

/// What a file may hold, too: the same features everywhere in rooms that cannot be.
TEST(MapMergerTest, TakesMapsOfNothingThatCouldBeSeen) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    testing::RandomMap a(seed), b(seed);
    const MergedMaps merged = merge_maps(a.map(), b.map(), seed);
    EXPECT_EQ(merged.map->broken_invariants(), "");
    EXPECT_EQ(merged.map->keyframes().size(), 2 * a.map().keyframes().size());
  }
}

TEST(MapMergerTest, TakesEmptyMaps) {
  const auto a = walk(0, 4, false, 1.0);
  const Map empty;
  EXPECT_EQ(merge_maps(a->map, empty, 1).map->keyframes().size(), 4u);
  EXPECT_EQ(merge_maps(empty, a->map, 1).map->keyframes().size(), 4u);
  EXPECT_EQ(merge_maps(empty, empty, 1).map->keyframes().size(), 0u);
}

}  // namespace
}  // namespace waymark

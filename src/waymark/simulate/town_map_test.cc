// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/town_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/loop/drift.h"
#include "waymark/simulate/testing/town_session.h"

namespace waymark {
namespace {

double error_of(const TownMap& town, KeyframeId id) {
  const Rigid3 map_from_rig = town.map->keyframes().at(id).rig_from_world.inverse();
  return (map_from_rig.translation - town.world_from_rig[id.value].translation).norm();
}

TEST(TownMap, AClosedMapIsSoundAndRight) {
  const TownMap town = make_town_map({.num_keyframes = 600, .num_recordings = 2});
  EXPECT_EQ(town.map->broken_invariants(), "");
  EXPECT_EQ(town.map->keyframes().size(), 600u);
  EXPECT_EQ(submaps_by_size(*town.map).size(), 1u);
  EXPECT_GT(town.map->landmarks().size(), 4000u);
  ASSERT_GE(town.revisits.size(), 2u);
  EXPECT_EQ(town.map->measured_loop_edges().size(), town.revisits.size() - 1);
  for (std::uint32_t i = 0; i < 600; ++i) EXPECT_LT(error_of(town, {i}), 0.06);
}

TEST(TownMap, AnOpenMapDriftsAndForgets) {
  const TownMap open = make_town_map({.num_keyframes = 400, .is_closed = false});
  const TownMap closed = make_town_map({.num_keyframes = 400});
  EXPECT_EQ(open.map->broken_invariants(), "");
  EXPECT_TRUE(open.map->measured_loop_edges().empty());
  EXPECT_LT(error_of(open, {20}), 0.1);
  EXPECT_GT(error_of(open, {399}), 0.05);
  EXPECT_GT(open.map->landmarks().size(), closed.map->landmarks().size());
  ASSERT_FALSE(open.revisits.empty());
  const LoopEdge& revisit = open.revisits.back();
  const auto way = shortest_way(*open.map, revisit.from, revisit.to);
  ASSERT_TRUE(way.has_value());
  EXPECT_GT(way->length, 30.0);
}

TEST(TownMap, IsTheSameEveryTime) {
  const TownMapSettings settings{.num_keyframes = 100, .is_closed = false};
  const TownMap a = make_town_map(settings);
  const TownMap b = make_town_map(settings);
  ASSERT_EQ(a.map->landmarks().size(), b.map->landmarks().size());
  a.map->landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_EQ(landmark.position_in_world, b.map->landmarks().at(id).position_in_world);
    EXPECT_EQ(landmark.observations, b.map->landmarks().at(id).observations);
  });
  const KeyframeId last{99};
  EXPECT_EQ(a.map->keyframes().at(last).rig_from_world.translation,
            b.map->keyframes().at(last).rig_from_world.translation);
}

class TownSessions : public ::testing::TestWithParam<int> {};

TEST_P(TownSessions, MapRoundABlock) {
  const int num_cameras = GetParam();
  const auto town = std::make_shared<const Town>(TownSettings{.num_columns = 2, .num_rows = 2});
  const auto rig = make_town_rig(num_cameras);
  TownRecordingSettings settings{.num_frames = 700, .step_m = 0.5};
  if (num_cameras == 1) settings.inverse_range_sigma = 0.002;
  const TownRecording recording(town, rig, settings);
  TownSession session(rig, true);
  const Rigid3 first = recording.world_from_rig(0);
  std::uint32_t num_tracked = 0;
  double worst = 0.0;
  for (std::uint32_t i = 0; i < settings.num_frames; ++i) {
    const Tracked outcome = session.track(recording.frame(i));
    if (!outcome.world_from_rig) continue;
    ++num_tracked;
    const Rigid3 truth = first.inverse() * recording.world_from_rig(i);
    worst = std::max(worst, (outcome.world_from_rig->translation - truth.translation).norm());
  }
  EXPECT_GE(num_tracked, settings.num_frames - 2);
  EXPECT_LT(worst, 1.0);
  EXPECT_GE(session.num_loops(), 1);
  EXPECT_EQ(session.map().broken_invariants(), "");
  EXPECT_EQ(submaps_by_size(session.map()).size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(Setups, TownSessions, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "depth" : "stereo";
});

}  // namespace
}  // namespace waymark

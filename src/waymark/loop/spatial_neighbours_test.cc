// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/spatial_neighbours.h"

#include <gtest/gtest.h>

#include "waymark/simulate/testing/town_map.h"

namespace waymark {
namespace {

constexpr SpatialNeighbourOptions kNear = {.num_known_steps = 1, .distance = 0.6, .angle_rad = 0.5};

class Beside : public ::testing::TestWithParam<bool> {};

TEST_P(Beside, PositionsFindTheSameAsAllKeyframes) {
  const TownMap town =
      make_town_map({.num_keyframes = 500, .num_recordings = 2, .is_closed = GetParam()});
  Map map = Map::thaw(*town.map);
  const KeyframePositions positions(map);
  for (const KeyframeId gone : {KeyframeId{20}, KeyframeId{21}, KeyframeId{300}}) {
    if (!map.has_loop_edge(gone)) map.erase_keyframe(gone);
  }
  std::size_t num_found = 0;
  map.keyframes().for_each([&](KeyframeId query, const Keyframe&) {
    for (const double distance : {0.05, 0.6, 5.0}) {
      SpatialNeighbourOptions options = kNear;
      options.distance = distance;
      const auto expected = find_spatial_neighbours(map, query, options);
      EXPECT_EQ(positions.find_spatial_neighbours(map, query, options), expected);
      num_found += expected.size();
    }
  });
  EXPECT_GT(num_found, 500u);
}

INSTANTIATE_TEST_SUITE_P(Maps, Beside, ::testing::Bool(), [](const auto& info) {
  return info.param ? "closed" : "open";
});

TEST_P(Beside, LivePositionsFindTheSameWhateverChanges) {
  const TownMap town = make_town_map({.num_keyframes = 500, .is_closed = GetParam()});
  Map map = Map::thaw(*town.map);
  LivePositions positions;
  SpatialNeighbourOptions options = kNear;
  options.distance = 2.0;
  std::size_t num_found = 0;
  const auto compare = [&](KeyframeId query) {
    const auto expected = find_spatial_neighbours(map, query, options);
    EXPECT_EQ(positions.find_spatial_neighbours(map, query, options), expected) << query.value;
    num_found += expected.size();
  };
  compare(KeyframeId{250});
  for (std::uint32_t i = 10; i < 490; i += 7) {
    if (i % 3 == 0) positions.follow(map.freeze());
    const KeyframeId moved{(13 * i) % 500};
    const Rigid3 near = map.keyframes().at(KeyframeId{i + 1}).rig_from_world;
    if (map.keyframes().contains(moved)) map.move_keyframe(moved, near);
    compare(KeyframeId{i + 1});
    if (!map.has_loop_edge(KeyframeId{i})) map.erase_keyframe(KeyframeId{i});
    compare(KeyframeId{i + 2});
  }
  EXPECT_GT(num_found, 100u);
}

TEST(KeyframesBeside, WhatSeesNothingHasNothingBeside) {
  const TownMap town = make_town_map({.num_keyframes = 60});
  Map map = Map::thaw(*town.map);
  const KeyframeId blind{30};
  for (std::uint32_t i = 0; i < map.keyframes().at(blind).landmarks.size(); ++i) {
    if (map.keyframes().at(blind).landmarks[i].is_valid()) map.forget(blind, i);
  }
  EXPECT_TRUE(find_spatial_neighbours(map, blind, kNear).empty());
  EXPECT_TRUE(KeyframePositions(map).find_spatial_neighbours(map, blind, kNear).empty());
  EXPECT_TRUE(LivePositions().find_spatial_neighbours(map, blind, kNear).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/partition.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "waymark/atlas/testing/atlas.h"
#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

TEST(CutTest, EachKeyframeIsInOneTileAsItWas) {
  const auto scene = walk_of_steps(0, 34, true);
  const PartitionedMap cut = partition_map(scene->map, 10);
  ASSERT_EQ(cut.tiles.size(), 4u);
  std::set<KeyframeId> seen;
  for (const PartitionTile& tile : cut.tiles) {
    EXPECT_EQ(tile.map.broken_invariants(), "");
    EXPECT_LE(tile.keyframes.size(), 10u);
    EXPECT_GE(tile.keyframes.size(), 8u);
    tile.map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      const KeyframeId was = tile.keyframes[id.value];
      EXPECT_TRUE(seen.insert(was).second);
      const Keyframe& whole = scene->map.keyframes().at(was);
      EXPECT_EQ(whole.rig_from_world.matrix(), keyframe.rig_from_world.matrix());
      EXPECT_EQ(whole.features, keyframe.features);
      for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
        if (!whole.landmarks[i].is_valid()) continue;
        EXPECT_EQ(tile.landmarks[keyframe.landmarks[i].value], whole.landmarks[i]);
      }
    });
    tile.map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
      EXPECT_EQ(scene->map.landmarks().at(tile.landmarks[id.value]).position_in_world,
                landmark.position_in_world);
    });
  }
  EXPECT_EQ(seen.size(), 34u);
}

TEST(CutTest, BordersNameWhatBothSee) {
  const auto scene = walk_of_steps(0, 34, true);
  const PartitionedMap cut = partition_map(scene->map, 10);
  ASSERT_GE(cut.borders.size(), 3u);
  for (const TileBorder& border : cut.borders) {
    ASSERT_LT(border.a, border.b);
    EXPECT_FALSE(border.landmarks.empty());
    for (const auto& [a, b] : border.landmarks) {
      EXPECT_EQ(cut.tiles[border.a].landmarks[a.value], cut.tiles[border.b].landmarks[b.value]);
    }
  }
}

TEST(CutTest, CutsWhatFilesMayHold) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    testing::RandomMap random(seed);
    const PartitionedMap cut = partition_map(random.map(), 8);
    std::size_t num_keyframes = 0;
    // Tiles of one sub-map hang together.
    std::map<std::size_t, std::size_t> above;
    const auto group = [&](std::size_t i) {
      while (above.contains(i)) i = above[i];
      return i;
    };
    for (const TileBorder& border : cut.borders) {
      EXPECT_EQ(cut.tiles[border.a].submap, cut.tiles[border.b].submap);
      const std::size_t a = group(border.a), b = group(border.b);
      if (a != b) above[std::max(a, b)] = std::min(a, b);
    }
    for (std::size_t i = 0; i < cut.tiles.size(); ++i) {
      EXPECT_EQ(cut.tiles[i].map.broken_invariants(), "") << seed;
      num_keyframes += cut.tiles[i].keyframes.size();
      for (std::size_t j = 0; j < i; ++j) {
        if (cut.tiles[i].submap != cut.tiles[j].submap) continue;
        EXPECT_EQ(group(i), group(j));
      }
    }
    EXPECT_EQ(num_keyframes, random.map().keyframes().size());
  }
}

TEST(CutTest, AnEmptyMapHasNoTiles) { EXPECT_TRUE(partition_map(Map(), 8).tiles.empty()); }

}  // namespace
}  // namespace waymark

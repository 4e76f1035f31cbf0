// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/steps.h"

#include <gmock/gmock.h>

#include <utility>
#include <vector>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

AtlasContents tiles_of(const std::vector<std::uint32_t>& num_keyframes) {
  AtlasContents contents;
  for (const std::uint32_t count : num_keyframes) {
    contents.tiles.emplace_back().num_keyframes = count;
  }
  return contents;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> divided(
    const std::vector<std::uint32_t>& num_keyframes, std::size_t max_keyframes) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ranges;
  for (const TileRange& range : divide_tiles(tiles_of(num_keyframes), max_keyframes)) {
    ranges.emplace_back(range.begin, range.end);
  }
  return ranges;
}

using Range = std::pair<std::uint32_t, std::uint32_t>;

TEST(DivideTiles, MakesRangesOfAboutTheSameSize) {
  EXPECT_THAT(divided({16, 16, 16, 16}, 64), ElementsAre(Range(0, 4)));
  EXPECT_THAT(divided({16, 16, 16, 16}, 48), ElementsAre(Range(0, 2), Range(2, 4)));
  EXPECT_THAT(divided({16, 16, 16, 16}, 16),
              ElementsAre(Range(0, 1), Range(1, 2), Range(2, 3), Range(3, 4)));
  EXPECT_THAT(divided({5, 100, 5}, 50), ElementsAre(Range(0, 1), Range(1, 2), Range(2, 3)));
  EXPECT_THAT(divided({}, 10), IsEmpty());
}

AlikeTile alike(std::uint32_t tile, double score) { return {tile, score, {KeyframeId{tile}}}; }

TEST(ChoosePairs, TakesTheBestOfAllRanges) {
  static_assert(kMaxLinksSought == 6);
  const auto pairs =
      choose_pairs({{0, {alike(1, 9.0), alike(2, 3.0), alike(3, 1.0)}},
                    {0, {alike(5, 8.0), alike(6, 7.0), alike(7, 6.0), alike(8, 5.0)}}});
  std::vector<std::uint32_t> others;
  for (const TilePair& pair : pairs) others.push_back(pair.a);
  EXPECT_THAT(others, ElementsAre(1, 2, 5, 6, 7, 8));
}

TEST(ChoosePairs, LooksForTheLaterTileInTheEarlier) {
  const auto pairs = choose_pairs({{0, {alike(4, 9.0)}}, {4, {alike(0, 1.0)}}});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].a, 0u);
  EXPECT_EQ(pairs[0].b, 4u);
  EXPECT_THAT(pairs[0].queries, ElementsAre(KeyframeId{0}));
}

}  // namespace
}  // namespace waymark

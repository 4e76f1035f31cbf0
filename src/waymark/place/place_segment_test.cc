// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/place/place_segment.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "waymark/base/check.h"
#include "waymark/place/testing/places.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;

constexpr auto kKeepAll = [](KeyframeId) { return false; };

PlaceSegment segment_of(std::uint32_t keyframe, const std::vector<Descriptor>& descriptors) {
  return PlaceSegment({KeyframeId{keyframe}, SubmapId{0}}, descriptors);
}

/// The rows of those entries around the key of a descriptor that have this very key.
std::set<std::size_t> rows_of_key(const PlaceSegment& segment,
                                  std::size_t table,
                                  const Descriptor& descriptor) {
  PlaceSegment::Window near;
  const std::size_t count =
      segment.look_around(table, place_keys(descriptor)[table], PlaceSegment::kMaxWindow, near);
  std::set<std::size_t> rows;
  for (std::size_t i = 0; i < count; ++i) {
    if (near[i] <= kPlaceRowMask) rows.insert(near[i]);
  }
  return rows;
}

std::vector<std::uint32_t> keyframes_of(const PlaceSegment& segment) {
  std::vector<std::uint32_t> ids;
  for (const PlaceRow& row : segment.rows()) ids.push_back(row.keyframe.value);
  return ids;
}

TEST(PlaceSegmentTest, TheWindowHoldsTheNeighboursInTheOrderOfKeys) {
  Rng rng(1, 0);
  const std::vector<Descriptor> place = random_place(500, rng);
  const PlaceSegment segment = segment_of(0, place);
  for (std::size_t table = 0; table < kNumPlaceTables; ++table) {
    std::vector<PlaceKey> keys;
    for (const Descriptor& descriptor : place) keys.push_back(place_keys(descriptor)[table]);
    std::sort(keys.begin(), keys.end());
    for (const Descriptor& query : random_place(100, rng)) {
      const PlaceKey key = place_keys(query)[table];
      PlaceSegment::Window near;
      ASSERT_EQ(segment.look_around(table, key, 8, near), 8u);
      auto middle = std::lower_bound(keys.begin(), keys.end(), key) - keys.begin();
      middle = std::clamp<std::ptrdiff_t>(middle, 4, 496);
      for (std::ptrdiff_t i = 0; i < 8; ++i) {
        EXPECT_EQ(near[static_cast<std::size_t>(i)] >> kPlaceRowBits,
                  keys[static_cast<std::size_t>(middle - 4 + i)] ^ key);
      }
    }
  }
}

TEST(PlaceSegmentTest, FindsEveryDescriptorThatItHoldsInEveryTable) {
  Rng rng(2, 0);
  const std::vector<Descriptor> place0 = random_place(1000, rng);
  const std::vector<Descriptor> place1 = random_place(777, rng);
  const PlaceSegment segment(segment_of(0, place0), segment_of(1, place1), kKeepAll);
  for (std::size_t table = 0; table < kNumPlaceTables; ++table) {
    for (const Descriptor& descriptor : place0) {
      EXPECT_TRUE(rows_of_key(segment, table, descriptor).contains(0));
    }
    for (const Descriptor& descriptor : place1) {
      EXPECT_TRUE(rows_of_key(segment, table, descriptor).contains(1));
    }
  }
}

TEST(PlaceSegmentTest, FindsTheExtremeKeys) {
  const Descriptor none = {};
  const Descriptor full = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX};
  const PlaceSegment segment(segment_of(0, {none}), segment_of(1, {full}), kKeepAll);
  for (std::size_t table = 0; table < kNumPlaceTables; ++table) {
    EXPECT_THAT(rows_of_key(segment, table, none), ElementsAre(0));
    EXPECT_THAT(rows_of_key(segment, table, full), ElementsAre(1));
  }
}

TEST(PlaceSegmentTest, MergingLeavesOutWhatIsGone) {
  Rng rng(3, 0);
  std::vector<std::vector<Descriptor>> places;
  PlaceSegment all;
  for (std::uint32_t i = 0; i < 6; ++i) {
    places.push_back(random_place(50, rng));
    all = PlaceSegment(all, segment_of(10 + i, places.back()), kKeepAll);
  }
  const auto is_gone = [](KeyframeId id) { return id.value == 10 || id.value == 13; };
  const PlaceSegment left(all, PlaceSegment(), is_gone);
  EXPECT_THAT(keyframes_of(left), ElementsAre(11, 12, 14, 15));
  EXPECT_TRUE(rows_of_key(left, 0, places[0][7]).empty());
  EXPECT_THAT(rows_of_key(left, 0, places[4][7]), ElementsAre(2));
  EXPECT_LT(left.num_bytes(), all.num_bytes());
}

TEST(PlaceSegmentTest, GivesNoMoreThanThereAre) {
  PlaceSegment::Window near;
  const std::size_t window = PlaceSegment::kMaxWindow;
  EXPECT_EQ(PlaceSegment().look_around(0, 1, window, near), 0u);
  EXPECT_EQ(segment_of(0, {}).look_around(kNumPlaceTables - 1, 1, window, near), 0u);
  Rng rng(4, 0);
  const std::vector<Descriptor> place = random_place(5, rng);
  EXPECT_EQ(segment_of(0, place).look_around(0, 1, window, near), 5u);
  EXPECT_EQ(segment_of(0, place).look_around(0, 1, 3, near), 3u);
  const std::vector<Descriptor> same(PlaceSegment::kMaxDescriptors, Descriptor{1, 2, 3, 4});
  const PlaceKey key = place_keys(same[0])[0];
  EXPECT_EQ(segment_of(0, same).look_around(0, key, window, near), window);
}

TEST(PlaceSegmentTest, RefusesToMergeInTheWrongOrder) {
  const std::vector<Descriptor> one(1);
  EXPECT_THROW(PlaceSegment(segment_of(2, one), segment_of(1, one), kKeepAll), CheckError);
}

TEST(ThinDescriptorsTest, KeepsAllOfFewAndAnEvenShareOfMany) {
  std::vector<Descriptor> many(3 * PlaceSegment::kMaxDescriptors);
  for (std::size_t i = 0; i < many.size(); ++i) many[i][0] = i;
  const std::vector<Descriptor> few(many.begin(), many.begin() + 10);
  EXPECT_EQ(thin_descriptors(few), few);
  const std::vector<Descriptor> thinned = thin_descriptors(many);
  ASSERT_EQ(thinned.size(), PlaceSegment::kMaxDescriptors);
  for (std::size_t i = 0; i < thinned.size(); ++i) EXPECT_EQ(thinned[i][0], 3 * i);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/place/place_index.h"

#include <gmock/gmock.h>

#include <map>

#include "waymark/base/check.h"
#include "waymark/place/testing/places.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Places = std::vector<std::vector<Descriptor>>;

constexpr std::size_t kNumDescriptors = 60;

Places random_places(std::size_t count, std::uint64_t seed) {
  Rng rng(seed, 0);
  Places places;
  for (std::size_t i = 0; i < count; ++i) places.push_back(random_place(kNumDescriptors, rng));
  return places;
}

PlaceIndex index_of(const Places& places) {
  PlaceIndex index;
  for (std::uint32_t i = 0; i < places.size(); ++i) index.add({i}, SubmapId{0}, places[i]);
  return index;
}

std::vector<std::uint32_t> ids_of(const std::vector<PlaceCandidate>& candidates) {
  std::vector<std::uint32_t> ids;
  for (const PlaceCandidate& candidate : candidates) ids.push_back(candidate.keyframe.value);
  return ids;
}

bool is_same(const std::vector<PlaceCandidate>& a, const std::vector<PlaceCandidate>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const PlaceCandidate& x, const PlaceCandidate& y) {
        return x.keyframe == y.keyframe && x.submap == y.submap && x.score == y.score;
      });
}

TEST(PlaceIndexTest, FindsEveryPlaceAgainWhateverItsSegment) {
  const Places places = random_places(300, 1);
  const PlaceIndex index = index_of(places);
  EXPECT_GT(index.num_segments(), 2u);
  Rng rng(2, 0);
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const auto candidates = index.find(seen_again(places[i], 0.08, rng), {});
    ASSERT_FALSE(candidates.empty());
    EXPECT_EQ(candidates[0].keyframe.value, i);
    const double second = candidates.size() > 1 ? candidates[1].score : 0.0;
    EXPECT_GT(candidates[0].score, 4 * second);
  }
}

TEST(PlaceIndexTest, TheScoreIsOneForAKeyframeThatAloneShowsAllOfTheQuery) {
  const Places places = random_places(40, 3);
  const auto candidates = index_of(places).find(places[17], {});
  ASSERT_FALSE(candidates.empty());
  EXPECT_EQ(candidates[0].keyframe.value, 17u);
  EXPECT_NEAR(candidates[0].score, 1.0, 0.01);  // A few of the others agree by chance.
}

TEST(PlaceIndexTest, RanksByTheShareOfTheQueryAndRareThingsAboveCommonOnes) {
  Rng rng(4, 0);
  const std::vector<Descriptor> rare = random_place(20, rng);
  const std::vector<Descriptor> common = random_place(20, rng);
  PlaceIndex index;
  for (std::uint32_t i = 0; i < 50; ++i) {
    std::vector<Descriptor> view = common;
    if (i == 30) view = rare;
    if (i == 31) view.assign(rare.begin(), rare.begin() + 10);
    index.add({i}, SubmapId{0}, view);
  }
  std::vector<Descriptor> query = rare;
  query.insert(query.end(), common.begin(), common.end());
  PlaceQuery four;
  four.max_candidates = 4;
  EXPECT_THAT(ids_of(index.find(query, four)), ElementsAre(30, 31, 0, 1));
}

TEST(PlaceIndexTest, GivesNoMoreThanAskedForAndNoneThatIsExcluded) {
  Rng rng(5, 0);
  const std::vector<Descriptor> place = random_place(kNumDescriptors, rng);
  const PlaceIndex index = index_of(Places(12, place));
  PlaceQuery query;
  query.max_candidates = 3;
  query.is_excluded = [](const PlaceRow& row) { return row.keyframe.value % 2 == 0; };
  EXPECT_THAT(ids_of(index.find(place, query)), ElementsAre(1, 3, 5));
  query.max_candidates = 0;
  EXPECT_THAT(index.find(place, query), IsEmpty());
}

TEST(PlaceIndexTest, CopiesStayAsTheyAre) {
  const Places places = random_places(100, 6);
  PlaceIndex index = index_of(places);
  const PlaceIndex frozen = index;
  const auto before = frozen.find(places[40], {});
  for (std::uint32_t i = 0; i < 80; ++i) EXPECT_TRUE(index.erase({i}));
  for (std::uint32_t i = 100; i < 200; ++i) index.add({i}, SubmapId{1}, places[i % 100]);
  index.join(SubmapId{0}, SubmapId{1});
  EXPECT_EQ(frozen.size(), 100u);
  EXPECT_TRUE(frozen.contains({40}));
  EXPECT_FALSE(frozen.contains({140}));
  EXPECT_TRUE(is_same(frozen.find(places[40], {}), before));
  EXPECT_EQ(index.find(places[40], {})[0].keyframe.value, 140u);
}

TEST(PlaceIndexTest, TheSameCallsGiveTheSameBits) {
  const Places places = random_places(150, 7);
  const auto run = [&] {
    PlaceIndex index = index_of(places);
    for (std::uint32_t i = 0; i < 150; i += 3) index.erase({i});
    return index;
  };
  const PlaceIndex a = run();
  const PlaceIndex b = run();
  Rng rng(8, 0);
  for (const std::vector<Descriptor>& place : places) {
    const std::vector<Descriptor> query = seen_again(place, 0.1, rng);
    EXPECT_TRUE(is_same(a.find(query, {}), b.find(query, {})));
  }
}

TEST(PlaceIndexTest, ErasedKeyframesAreNotFoundAndTheirMemoryReturns) {
  const Places places = random_places(256, 9);
  PlaceIndex index = index_of(places);
  const std::size_t full_bytes = index.num_bytes();
  for (std::uint32_t i = 0; i < 256; ++i) {
    if (i % 8 == 0) continue;
    EXPECT_TRUE(index.erase({i}));
    EXPECT_FALSE(index.erase({i}));
    EXPECT_FALSE(index.contains({i}));
  }
  EXPECT_EQ(index.size(), 32u);
  EXPECT_LT(index.num_bytes(), full_bytes / 3);
  for (std::uint32_t i = 0; i < 256; ++i) {
    const auto candidates = index.find(places[i], {});
    const bool is_found = !candidates.empty() && candidates[0].keyframe.value == i;
    EXPECT_EQ(is_found, i % 8 == 0);
    for (const PlaceCandidate& candidate : candidates) {
      EXPECT_EQ(candidate.keyframe.value % 8, 0u);
    }
  }
}

TEST(PlaceIndexTest, AnIndexThatLostEverythingIsEmptyAndGoesOn) {
  const Places places = random_places(70, 10);
  PlaceIndex index = index_of(places);
  for (std::uint32_t i = 0; i < 70; ++i) EXPECT_TRUE(index.erase({i}));
  EXPECT_EQ(index.size(), 0u);
  EXPECT_EQ(index.num_segments(), 0u);
  EXPECT_THAT(index.find(places[3], {}), IsEmpty());
  index.add({70}, SubmapId{0}, places[3]);
  EXPECT_THAT(ids_of(index.find(places[3], {})), ElementsAre(70));
}

TEST(PlaceIndexTest, JoinedSubmapsAreOne) {
  const Places places = random_places(3, 11);
  PlaceIndex index;
  for (std::uint32_t i = 0; i < 3; ++i) index.add({i}, SubmapId{i}, places[i]);
  index.join(SubmapId{2}, SubmapId{1});
  EXPECT_EQ(index.find(places[2], {})[0].submap, SubmapId{1});
  index.join(SubmapId{1}, SubmapId{0});
  for (const std::vector<Descriptor>& place : places) {
    EXPECT_EQ(index.find(place, {})[0].submap, SubmapId{0});
  }
  PlaceQuery elsewhere;
  elsewhere.is_excluded = [](const PlaceRow& row) { return row.submap == SubmapId{0}; };
  EXPECT_THAT(index.find(places[2], elsewhere), IsEmpty());
  EXPECT_THROW(index.join(SubmapId{0}, SubmapId{2}), CheckError);
}

TEST(PlaceIndexTest, TakesKeyframesAndQueriesWithoutDescriptors) {
  PlaceIndex index;
  EXPECT_THAT(index.find({}, {}), IsEmpty());
  EXPECT_THAT(index.find(std::vector<Descriptor>(5), {}), IsEmpty());
  EXPECT_FALSE(index.contains({0}));
  index.add({0}, SubmapId{0}, {});
  EXPECT_THAT(index.find(std::vector<Descriptor>(5), {}), IsEmpty());
  EXPECT_TRUE(index.erase({0}));
}

TEST(PlaceIndexTest, RefusesKeyframesOutOfOrder) {
  PlaceIndex index;
  index.add({5}, SubmapId{0}, {});
  EXPECT_THROW(index.add({5}, SubmapId{0}, {}), CheckError);
  EXPECT_THROW(index.add({4}, SubmapId{0}, {}), CheckError);
  EXPECT_THROW(index.add(KeyframeId{}, SubmapId{0}, {}), CheckError);
}

TEST(PlaceIndexTest, AViewOfOneThingRepeatedIsHarmless) {
  const std::vector<Descriptor> same(kNumDescriptors, Descriptor{1, 2, 3, 4});
  const PlaceIndex index = index_of(Places(200, same));
  for (const PlaceCandidate& candidate : index.find(same, {})) {
    EXPECT_GT(candidate.score, 0.0);
    EXPECT_LE(candidate.score, 1.0);
  }
}

TEST(PlaceIndexTest, RandomEditsAgreeWithAPlainTable) {
  const Places places = random_places(60, 12);
  Rng rng(13, 0);
  PlaceIndex index;
  std::map<std::uint32_t, std::size_t> living;  // Keyframe to place.
  for (std::uint32_t next = 0; next < 600; ++next) {
    const std::size_t place = rng.below(60);
    index.add({next}, SubmapId{next / 100}, places[place]);
    living[next] = place;
    for (std::uint32_t i = rng.below(3); i > 0 && next > 10; --i) {
      const std::uint32_t id = rng.below(next + 1);
      EXPECT_EQ(index.erase({id}), living.erase(id) == 1);
    }
    ASSERT_EQ(index.size(), living.size());
    ASSERT_LE(index.num_segments(), 8u);
    if (next % 50 != 0) continue;
    for (std::uint32_t id = 0; id <= next; ++id) {
      ASSERT_EQ(index.contains({id}), living.contains(id));
    }
    const auto candidates = index.find(places[place], {});
    ASSERT_FALSE(candidates.empty());
    EXPECT_EQ(living.at(candidates[0].keyframe.value), place);
    EXPECT_EQ(candidates[0].submap.value, candidates[0].keyframe.value / 100);
  }
}

}  // namespace
}  // namespace waymark

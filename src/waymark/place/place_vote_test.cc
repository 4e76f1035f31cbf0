// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "waymark/place/place_segment.h"
#include "waymark/place/testing/places.h"

namespace waymark {
namespace {

using Segments = std::vector<std::shared_ptr<const PlaceSegment>>;
using Views = std::vector<std::vector<Descriptor>>;

/// As many segments as there are views, or one.
Segments segments_of(const Views& views, bool is_merged) {
  Segments segments;
  for (std::uint32_t i = 0; i < views.size(); ++i) {
    auto segment = std::make_shared<const PlaceSegment>(PlaceRow{{i}, SubmapId{0}}, views[i]);
    if (is_merged && i > 0) {
      segments[0] = std::make_shared<const PlaceSegment>(
          *segments[0], *segment, [](KeyframeId) { return false; });
    } else {
      segments.push_back(segment);
    }
  }
  return segments;
}

Views views_of(const std::vector<Descriptor>& place, std::size_t count, double flips, Rng& rng) {
  Views views;
  for (std::size_t i = 0; i < count; ++i) views.push_back(seen_again(place, flips, rng));
  return views;
}

bool is_alike(const Descriptor& a, const Descriptor& b) {
  const auto keys_a = place_keys(a);
  const auto keys_b = place_keys(b);
  for (std::size_t i = 0; i < keys_a.size(); ++i) {
    if (std::popcount(keys_a[i] ^ keys_b[i]) <= 8) return true;
  }
  return false;
}

/// Compares all with all.
std::vector<double> count_votes(const Views& views, const std::vector<Descriptor>& query) {
  std::vector<double> scores(views.size(), 0.0);
  const auto num_views = static_cast<double>(views.size());
  for (const Descriptor& descriptor : query) {
    std::vector<std::size_t> voted;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto matches = [&](const Descriptor& other) { return is_alike(descriptor, other); };
      if (std::any_of(views[i].begin(), views[i].end(), matches)) voted.push_back(i);
    }
    for (const std::size_t i : voted) {
      scores[i] += std::log1p(num_views / static_cast<double>(voted.size()));
    }
  }
  for (double& score : scores) {
    score /= static_cast<double>(query.size()) * std::log1p(num_views);
  }
  return scores;
}

TEST(VoteForPlacesTest, EqualsComparingAllWithAllWhereNeighbourhoodsHoldAll) {
  Rng rng(1, 0);
  // 30 descriptors in all: each is a neighbour of every query.
  const std::vector<Descriptor> place = random_place(6, rng);
  const Views views = views_of(place, 5, 0.14, rng);
  const std::vector<Descriptor> query = seen_again(place, 0.04, rng);
  const std::vector<double> expected = count_votes(views, query);
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()),
            *std::min_element(expected.begin(), expected.end()));
  const std::vector<double> scores = vote_for_places(segments_of(views, true), query);
  ASSERT_EQ(scores.size(), expected.size());
  for (std::size_t i = 0; i < scores.size(); ++i) EXPECT_NEAR(scores[i], expected[i], 1e-12);
}

TEST(VoteForPlacesTest, DoesNotFavourRowsOfSmallSegments) {
  Rng rng(2, 0);
  // A crowd in one large segment and as many views of the same place one by one.
  const std::vector<Descriptor> place = random_place(100, rng);
  const Views views = views_of(place, 40, 0.1, rng);
  const Views first_half(views.begin(), views.begin() + 20);
  Segments segments = segments_of(first_half, true);
  for (std::uint32_t i = 20; i < 40; ++i) {
    segments.push_back(std::make_shared<const PlaceSegment>(PlaceRow{{i}, SubmapId{0}}, views[i]));
  }
  const std::vector<double> scores = vote_for_places(segments, place);
  double crowd = 0.0;
  double alone = 0.0;
  for (std::size_t i = 0; i < 40; ++i) (i < 20 ? crowd : alone) += scores[i];
  EXPECT_NEAR(alone / crowd, 1.0, 0.1);
}

TEST(VoteForPlacesTest, MergingSegmentsChangesLittle) {
  Rng rng(3, 0);
  const std::vector<Descriptor> place = random_place(100, rng);
  Views views = views_of(place, 4, 0.08, rng);
  for (int i = 0; i < 36; ++i) views.push_back(random_place(100, rng));
  const std::vector<double> apart = vote_for_places(segments_of(views, false), place);
  const std::vector<double> merged = vote_for_places(segments_of(views, true), place);
  for (std::size_t i = 0; i < views.size(); ++i) EXPECT_NEAR(apart[i], merged[i], 0.02);
  EXPECT_GT(merged[0], 0.2);
  EXPECT_LT(merged[10], 0.02);
}

}  // namespace
}  // namespace waymark

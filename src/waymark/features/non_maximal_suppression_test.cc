// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/non_maximal_suppression.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace waymark {
namespace {

constexpr int kSpreadWidth = 400;
constexpr int kSpreadHeight = 300;

int sum(const LevelCounts& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

TEST(ShareAmongLevels, GoesWithTheInverseScale) {
  LevelCounts available;
  available.fill(100000);
  const LevelCounts counts = share_among_levels(1000, available);
  EXPECT_EQ(sum(counts), 1000);
  for (std::size_t i = 1; i < counts.size(); ++i) {
    EXPECT_NEAR(counts[i] * 1.2, counts[i - 1], 1.5);
  }
}

TEST(ShareAmongLevels, AsksOthersForWhatALevelLacks) {
  const LevelCounts available{1000, 3, 1000, 0, 50, 1000, 0, 9};
  for (int count : {1, 7, 100, 999, 2000, 3062}) {
    const LevelCounts counts = share_among_levels(count, available);
    EXPECT_EQ(sum(counts), count);
    for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_LE(counts[i], available[i]);
  }
  EXPECT_EQ(share_among_levels(5000, available), available);
}

std::vector<Corner> make_corners(int width, int height, double density, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Corner> corners;
  for (int y = 0; y < height; y += 2) {
    for (int x = 0; x < width; x += 2) {
      if (static_cast<double>(random() % 1000) >= 1000.0 * density) continue;
      corners.push_back({static_cast<std::uint16_t>(x),
                         static_cast<std::uint16_t>(y),
                         static_cast<std::uint8_t>(8 + random() % 200)});
    }
  }
  return corners;
}

bool is_read_before(const Corner& a, const Corner& b) {
  return a.y_px != b.y_px ? a.y_px < b.y_px : a.x_px < b.x_px;
}

std::vector<Corner> select(const std::vector<Corner>& corners, int count) {
  NonMaximalSuppression selector;
  selector.reserve(kSpreadWidth, kSpreadHeight, count);
  std::vector<Corner> selected;
  selector.select(corners, kSpreadWidth, kSpreadHeight, count, selected);
  return selected;
}

TEST(NonMaximalSuppression, ReturnsAsManyAsAskedForInRasterOrder) {
  for (double density : {0.02, 0.1, 0.9}) {
    const std::vector<Corner> corners = make_corners(kSpreadWidth, kSpreadHeight, density, 1);
    for (int count : {0, 1, 2, 10, 100, 290, 1000, 5000, 100000}) {
      const std::vector<Corner> selected = select(corners, count);
      EXPECT_EQ(selected.size(), std::min<std::size_t>(corners.size(), count));
      EXPECT_TRUE(std::is_sorted(selected.begin(), selected.end(), is_read_before));
      EXPECT_EQ(std::adjacent_find(selected.begin(), selected.end()), selected.end());
      EXPECT_TRUE(std::includes(
          corners.begin(), corners.end(), selected.begin(), selected.end(), is_read_before));
    }
  }
}

TEST(NonMaximalSuppression, CoversWeakPartsOfTheImage) {
  // The left half is weak, the right half strong and dense.
  std::vector<Corner> corners = make_corners(kSpreadWidth, kSpreadHeight, 0.3, 2);
  for (Corner& corner : corners) {
    corner.score = corner.x_px < kSpreadWidth / 2 ? 10 : 100;
  }
  const std::vector<Corner> selected = select(corners, 200);
  const auto num_left = std::count_if(
      selected.begin(), selected.end(), [](const Corner& c) { return c.x_px < kSpreadWidth / 2; });
  // Half of the features cover the image evenly, the other half are the strongest.
  EXPECT_NEAR(static_cast<double>(num_left), 50.0, 8.0);
}

TEST(NonMaximalSuppression, LeavesNoHoles) {
  const std::vector<Corner> selected =
      select(make_corners(kSpreadWidth, kSpreadHeight, 0.5, 3), 200);
  // The 100 that cover the image would be sqrt(400 * 300 / 100) = 34.6 apart on a square lattice.
  for (int y = 0; y < kSpreadHeight; y += 5) {
    for (int x = 0; x < kSpreadWidth; x += 5) {
      double nearest = 1e9;
      for (const Corner& c : selected)
        nearest = std::min(nearest, std::hypot(c.x_px - x, c.y_px - y));
      EXPECT_LT(nearest, 45.0) << x << ' ' << y;
    }
  }
}

TEST(NonMaximalSuppression, TakesTheStrongest) {
  std::vector<Corner> corners = make_corners(kSpreadWidth, kSpreadHeight, 0.3, 4);
  for (Corner& corner : corners) corner.score = 50;
  const std::size_t middle = corners.size() / 2;
  corners[middle].score = 51;
  EXPECT_THAT(select(corners, 50), ::testing::Contains(corners[middle]));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/view_regions.h"

#include <gtest/gtest.h>

#include <set>

#include "waymark/base/rng.h"
#include "waymark/geometry/test_scenes.h"

namespace waymark {
namespace {

std::vector<Eigen::Vector3d> all_round(std::size_t count) {
  Rng rng(1, 0);
  std::vector<Eigen::Vector3d> bearings;
  for (std::size_t i = 0; i < count; ++i) bearings.push_back(testing::random_direction(rng));
  return bearings;
}

TEST(ViewRegions, HoldEachBearingOnceBesideItsNeighbours) {
  const std::vector<Eigen::Vector3d> bearings = all_round(5000);
  ViewRegions regions;
  regions.sort(std::span<const Eigen::Vector3d>(bearings));
  std::set<std::uint32_t> seen;
  regions.for_each([&](std::span<const std::uint32_t> members) {
    EXPECT_TRUE(std::ranges::is_sorted(members));
    for (const std::uint32_t i : members) {
      EXPECT_TRUE(seen.insert(i).second);
      EXPECT_LT((bearings[i] - bearings[members[0]]).norm(), 1.8 * ViewRegions::kSizeRad);
    }
  });
  EXPECT_EQ(seen.size(), bearings.size());
}

TEST(ViewRegions, HaveAsManyVotesHoweverManyTheyAre) {
  std::vector<Eigen::Vector3d> bearings(500, Eigen::Vector3d(0.02, 0.01, 1.0).normalized());
  for (int i = 0; i < 3; ++i) bearings.push_back(Eigen::Vector3d(0.52, 0.01, 1.0).normalized());
  ViewRegions regions;
  regions.sort(std::span<const Eigen::Vector3d>(bearings));
  const std::vector<std::uint32_t> votes = regions.votes();
  EXPECT_EQ(votes.size(), ViewRegions::kVotes + 3);
  EXPECT_EQ(std::ranges::count_if(votes, [](std::uint32_t i) { return i >= 500; }), 3);
}

/// Errors of 30 regions of 10 with this noise, each off by its own mean of that size.
double contradiction(double noise, double of_regions) {
  Rng rng(2, 0);
  Contradiction contradiction;
  for (int region = 0; region < 30; ++region) {
    const Eigen::Vector2d mean(of_regions * rng.normal(), of_regions * rng.normal());
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double squares = 0.0;
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector2d error = mean + noise * Eigen::Vector2d(rng.normal(), rng.normal());
      sum += error;
      squares += error.squaredNorm();
    }
    contradiction.add(10.0, sum.squaredNorm(), squares);
  }
  return contradiction.ratio();
}

TEST(Contradiction, IsWhatRegionsAreOffByOverTheNoise) {
  EXPECT_NEAR(contradiction(0.3, 0.0), 0.0, 0.06);
  EXPECT_NEAR(contradiction(3.0, 0.0), 0.0, 0.06) << "whatever the noise";
  EXPECT_NEAR(contradiction(0.3, 0.15), 0.25, 0.12);
  EXPECT_NEAR(contradiction(0.3, 0.6), 4.0, 1.2);
}

TEST(Contradiction, TakesSeveralRegionsOfSeveralErrors) {
  Contradiction contradiction;
  EXPECT_EQ(contradiction.ratio(), 0.0);
  contradiction.add(2.0, 100.0, 60.0);
  contradiction.add(10.0, 1000.0, 101.0);
  EXPECT_EQ(contradiction.ratio(), 0.0);
  contradiction.add(10.0, 1000.0, 101.0);
  EXPECT_GT(contradiction.ratio(), 1.0);
}

}  // namespace
}  // namespace waymark

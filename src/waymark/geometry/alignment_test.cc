// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/alignment.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::random_pose;
using testing::random_vector;

struct PointSets {
  std::vector<Eigen::Vector3d> a, b;
};

// Points stretched along each axis and moved by b_from_a, with noise.
PointSets make_points(const Sim3& b_from_a, const Eigen::Vector3d& extent, double noise, Rng& rng) {
  PointSets sets;
  for (int i = 0; i < 60; ++i) {
    sets.a.push_back(extent.cwiseProduct(random_vector(rng)) + Eigen::Vector3d(10, -20, 5));
    sets.b.push_back(b_from_a * sets.a.back() + noise * random_vector(rng));
  }
  return sets;
}

Sim3 random_similarity(Rng& rng) {
  Sim3 b_from_a(random_pose(rng, rng.uniform(0.0, 3.1), 5.0));
  b_from_a.scale = rng.uniform(0.1, 8.0);
  return b_from_a;
}

void expect_near(const Sim3& estimate, const Sim3& truth, double tolerance) {
  EXPECT_LT(estimate.rotation.angularDistance(truth.rotation), tolerance);
  EXPECT_LT((estimate.translation - truth.translation).norm(), 100.0 * tolerance);
  EXPECT_NEAR(estimate.scale / truth.scale, 1.0, tolerance);
}

TEST(AlignSimilarity, RecoversRandomSimilaritiesOfSolidAndFlatClouds) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 50; ++trial) {
    const Sim3 b_from_a = random_similarity(rng);
    for (const double thickness : {1.0, 0.0}) {
      const PointSets sets = make_points(b_from_a, {3.0, 2.0, thickness}, 0.0, rng);
      const auto estimate = align_similarity(sets.a, sets.b);
      ASSERT_TRUE(estimate);
      expect_near(*estimate, b_from_a, 1e-7);
    }
  }
}

// Umeyama's published example: three points whose optimum would be a reflection.
TEST(AlignSimilarity, ReproducesTheExampleOfThePaper) {
  const std::vector<Eigen::Vector3d> a = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  const std::vector<Eigen::Vector3d> b = {{0, 0, 0}, {-1, 0, 0}, {0, 2, 0}};
  // In 3-D the mirror image of a flat figure is a half turn, so the fit is exact.
  const auto estimate = align_similarity(a, b);
  ASSERT_TRUE(estimate);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((*estimate * a[i] - b[i]).norm(), 1e-12);
}

TEST(AlignRigid, NeverReturnsAReflection) {
  Rng rng(2, 0);
  PointSets sets = make_points(Sim3{}, {1, 1, 1}, 0.0, rng);
  for (Eigen::Vector3d& point : sets.b) point.z() = -point.z();
  const auto directions = align_directions(sets.a, sets.b);
  ASSERT_TRUE(directions);
  EXPECT_NEAR(directions->determinant(), 1.0, 1e-12);
  ASSERT_TRUE(align_rigid(sets.a, sets.b));
}

// The optimum by Umeyama's closed form is where the numeric gradient vanishes.
TEST(AlignSimilarity, MinimisesTheWeightedDistances) {
  Rng rng(3, 0);
  const Sim3 b_from_a = random_similarity(rng);
  const PointSets sets = make_points(b_from_a, {3, 2, 1}, 0.3, rng);
  std::vector<double> weights;
  for (std::size_t i = 0; i < sets.a.size(); ++i) weights.push_back(rng.uniform());
  const auto estimate = align_similarity(sets.a, sets.b, weights);
  ASSERT_TRUE(estimate);
  const auto cost = [&](const Vector7d& xi) {
    const Sim3 moved = Sim3::exp(xi) * *estimate;
    double sum = 0.0;
    for (std::size_t i = 0; i < sets.a.size(); ++i) {
      sum += weights[i] * (moved * sets.a[i] - sets.b[i]).squaredNorm();
    }
    return sum;
  };
  for (int k = 0; k < 7; ++k) {
    const Vector7d delta = 1e-5 * Vector7d::Unit(k);
    EXPECT_NEAR((cost(delta) - cost(-delta)) / 2e-5, 0.0, 1e-3 * cost(Vector7d::Zero()));
    EXPECT_GT(cost(100.0 * delta), cost(Vector7d::Zero()));
  }
}

TEST(AlignRigid, RecoversMotionAndIgnoresPointsOfNoWeight) {
  Rng rng(4, 0);
  Sim3 b_from_a = random_similarity(rng);
  b_from_a.scale = 1.0;
  PointSets sets = make_points(b_from_a, {3, 2, 1}, 0.0, rng);
  std::vector<double> weights(sets.a.size(), 2.0);
  sets.b[7] = Eigen::Vector3d(1e3, 0, 0);
  weights[7] = 0.0;
  const auto estimate = align_rigid(sets.a, sets.b, weights);
  ASSERT_TRUE(estimate);
  expect_near(Sim3(*estimate), b_from_a, 1e-9);
}

TEST(Align, RefusesWhatItCannotDetermine) {
  const std::vector<Eigen::Vector3d> none;
  EXPECT_FALSE(align_rigid(none, none));
  EXPECT_FALSE(align_directions(none, none));
  const std::vector<Eigen::Vector3d> same(10, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(align_similarity(same, same));
  EXPECT_FALSE(align_directions(same, same));
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 2 * i, -i);
  EXPECT_FALSE(align_similarity(line, line));
  std::vector<Eigen::Vector3d> bad = {{0, 0, 0}, {1, 0, 0}, {0, 1, std::nan("")}};
  EXPECT_FALSE(align_rigid(bad, bad));
  EXPECT_THROW(align_rigid(line, same, std::vector<double>{1.0}), CheckError);
}

TEST(Associate, PairsEachPoseWithTheNearestOnce) {
  const std::vector<std::int64_t> a = {0, 10, 20, 22, 100};
  const std::vector<std::int64_t> b = {-1, 11, 21, 50};
  const std::vector<PosePair> pairs = associate(a, b, 5);
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_EQ(pairs[0].a, 0u);
  EXPECT_EQ(pairs[0].b, 0u);
  EXPECT_EQ(pairs[1].a, 1u);
  EXPECT_EQ(pairs[1].b, 1u);
  EXPECT_EQ(pairs[2].a, 2u);  // 20 and 22 are equally near to 21; the earlier one has it
  EXPECT_EQ(pairs[2].b, 2u);
  EXPECT_TRUE(associate(a, {}, 5).empty());
  EXPECT_TRUE(associate({}, b, 5).empty());
}

}  // namespace
}  // namespace waymark

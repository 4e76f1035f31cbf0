// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/ransac.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

// y = slope * x + offset, with known noise.
struct Line {
  double slope = 0.0;
  double offset = 0.0;
};

class LineEstimator {
 public:
  using Model = Line;
  static constexpr std::size_t kSampleSize = 2;
  static constexpr double kMaxSquaredError = 3.84;

  LineEstimator(std::vector<Eigen::Vector2d> points, double sigma)
      : points_(std::move(points)), sigma_(sigma) {}

  std::size_t num_data() const { return points_.size(); }

  std::vector<Line> fit(std::span<const std::uint32_t, kSampleSize> sample) const {
    const Eigen::Vector2d &p = points_[sample[0]], &q = points_[sample[1]];
    if (p.x() == q.x()) return {};
    const double slope = (q.y() - p.y()) / (q.x() - p.x());
    return {{slope, p.y() - slope * p.x()}};
  }

  double squared_error(const Line& line, std::size_t index) const {
    const double error = points_[index].y() - line.slope * points_[index].x() - line.offset;
    return error * error / (sigma_ * sigma_);
  }

  std::optional<Line> refine(const Line& line, std::span<const std::uint32_t> nearby) const {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const std::uint32_t index : nearby) {
      if (squared_error(line, index) > kMaxSquaredError) continue;
      const Eigen::Vector2d& p = points_[index];
      n += 1, x += p.x(), y += p.y(), xx += p.x() * p.x(), xy += p.x() * p.y();
    }
    const double determinant = n * xx - x * x;
    if (determinant <= 0.0) return std::nullopt;
    const double slope = (n * xy - x * y) / determinant;
    return Line{slope, (y - slope * x) / n};
  }

 private:
  std::vector<Eigen::Vector2d> points_;
  double sigma_;
};

constexpr double kLineSigma = 0.01;

LineEstimator noisy_line(const Line& line, int num_inliers, int num_outliers, std::uint64_t seed) {
  Rng rng(seed, 0);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < num_inliers + num_outliers; ++i) {
    const double x = rng.uniform(-1.0, 1.0);
    const double y = i < num_inliers ? line.slope * x + line.offset + kLineSigma * rng.normal()
                                     : rng.uniform(-3.0, 3.0);
    points.emplace_back(x, y);
  }
  return LineEstimator(points, kLineSigma);
}

TEST(Ransac, FindsTheLineAmongOutliers) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const auto result =
        ransac(noisy_line({0.7, -0.2}, 100, 100, seed), {.seed = seed, .stream = 3});
    ASSERT_TRUE(result);
    // Ten standard deviations of a fit to 95 points: least squares does not know its inliers.
    EXPECT_NEAR(result->model.slope, 0.7, 10.0 * kLineSigma / std::sqrt(95.0 / 3.0));
    EXPECT_NEAR(result->model.offset, -0.2, 10.0 * kLineSigma / std::sqrt(95.0));
    EXPECT_GT(result->inliers.size(), 80u);
    EXPECT_LT(result->inliers.size(), 115u);
  }
}

TEST(Ransac, StopsOnceItIsSureAndNotBefore) {
  const auto easy = ransac(noisy_line({0.7, -0.2}, 200, 0, 1), {});
  const auto hard = ransac(noisy_line({0.7, -0.2}, 60, 140, 1), {.min_inlier_ratio = 0.1});
  ASSERT_TRUE(easy && hard);
  EXPECT_LE(easy->num_iterations, 10);
  // log(0.001) / log(1 - 0.3^2) = 73
  EXPECT_GT(hard->num_iterations, 40);
  EXPECT_LT(hard->num_iterations, 110);
  const auto limited = ransac(noisy_line({0.7, -0.2}, 60, 140, 1), {.min_inlier_ratio = 0.5});
  // log(0.001) / log(1 - 0.5^2)
  EXPECT_TRUE(!limited || limited->num_iterations == 25);
}

TEST(Ransac, SameSeedAndStreamGiveTheSameBits) {
  const LineEstimator estimator = noisy_line({0.7, -0.2}, 80, 120, 9);
  const auto first = ransac(estimator, {.seed = 4, .stream = 17});
  const auto second = ransac(estimator, {.seed = 4, .stream = 17});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->model.slope, second->model.slope);
  EXPECT_EQ(first->model.offset, second->model.offset);
  EXPECT_EQ(first->cost, second->cost);
  EXPECT_EQ(first->num_iterations, second->num_iterations);
  EXPECT_EQ(first->inliers, second->inliers);
}

TEST(Ransac, GivesNothingWhereThereIsNothing) {
  EXPECT_FALSE(ransac(LineEstimator({}, kLineSigma), {}));
  EXPECT_FALSE(ransac(LineEstimator({{0.0, 0.0}}, kLineSigma), {}));
  EXPECT_FALSE(ransac(LineEstimator({{0.0, 0.0}, {1.0, 0.0}}, kLineSigma), {}));  // no third
  const LineEstimator same(std::vector<Eigen::Vector2d>(20, {0.5, 0.5}), kLineSigma);
  EXPECT_FALSE(ransac(same, RansacOptions{}));
  const LineEstimator bad(std::vector<Eigen::Vector2d>(20, {0.5, std::nan("")}), kLineSigma);
  EXPECT_FALSE(ransac(bad, RansacOptions{}));
}

TEST(DrawDistinct, DrawsEachDatumEquallyOftenAndOnce) {
  Rng rng(5, 0);
  std::vector<int> counts(7, 0);
  for (int i = 0; i < 7000; ++i) {
    const auto sample = ransac_internal::draw_distinct<5>(rng, 7);
    for (std::size_t j = 0; j < 5; ++j) {
      ++counts[sample[j]];
      for (std::size_t k = 0; k < j; ++k) EXPECT_NE(sample[j], sample[k]);
    }
  }
  for (const int count : counts) EXPECT_NEAR(count, 5000, 200);
}

}  // namespace
}  // namespace waymark

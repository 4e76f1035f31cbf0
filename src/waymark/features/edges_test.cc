// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kSizePx = 120;

/// Grey 80 where distance(x, y) is negative, more by `height` where it is positive; areas are
/// integrated over one pixel, and blurred a little as lenses do.
template <class Distance>
PaddedImage make_step(Distance distance, double height = 30.0) {
  PaddedImage image;
  image.resize(kSizePx, kSizePx);
  for (int y = 0; y < kSizePx; ++y) {
    for (int x = 0; x < kSizePx; ++x) {
      const double lit = 0.5 * (1.0 + std::erf(distance(x, y) / 0.9));
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(80.0 + height * lit));
    }
  }
  return image;
}

TEST(Edges, LieAcrossAStepToATenthOfAPixel) {
  EdgeFinder finder;
  for (int degrees = -180; degrees < 180; degrees += 17) {
    const double angle = degrees * std::numbers::pi / 180.0;
    const auto distance = [&](double x, double y) {
      return std::cos(angle) * (x - 60.3) + std::sin(angle) * (y - 59.1);
    };
    const auto points = finder.find(make_step(distance), {}, {});
    EXPECT_GT(points.size(), 8u) << degrees;
    for (const EdgePoint& point : points) {
      EXPECT_NEAR(distance(point.x_px, point.y_px), 0.0, 0.12) << degrees;
      EXPECT_GT(std::cos(point.angle_rad - angle), 0.999) << degrees;
      EXPECT_NEAR(point.slope, 10.0, 2.0);
    }
  }
}

TEST(Edges, AreStraight) {
  EdgeFinder finder;
  const auto ring = [](double radius) {
    return make_step([=](double x, double y) { return radius - std::hypot(x - 60.0, y - 60.0); });
  };
  EXPECT_TRUE(finder.find(ring(5.0), {}, {}).empty());
  EXPECT_GT(finder.find(ring(40.0), {}, {}).size(), 20u);
}

TEST(Edges, AreNotMadeOfNoise) {
  PaddedImage image = make_step([](double, double) { return -100.0; });
  const PaddedImage noise = testing::make_noise(kSizePx, kSizePx, 5);
  for (int y = 0; y < kSizePx; ++y) {
    for (int x = 0; x < kSizePx; ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(80 + noise.row(y)[x] / 32);
    }
  }
  EdgeFinder finder;
  EXPECT_TRUE(finder.find(image, {}, {}).empty());
}

/// Noise of this standard deviation, in grey values, on top of an image.
void add_noise(double sigma, PaddedImage& image) {
  Rng rng(3, 0);
  for (int y = 0; y < kSizePx; ++y) {
    for (int x = 0; x < kSizePx; ++x) {
      const double grey = image.row(y)[x] + sigma * rng.normal();
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0l, 255l));
    }
  }
}

TEST(Edges, MayBeFaintWhereThereIsLittleNoise) {
  const auto distance = [](double x, double y) { return 0.6 * (x - 60.3) + 0.8 * (y - 59.1); };
  PaddedImage image = make_step(distance, 5.0);
  add_noise(0.5, image);
  EdgeFinder finder;
  EXPECT_GT(finder.find(image, {}, {}).size(), 8u);
  add_noise(3.0, image);
  EXPECT_LT(finder.find(image, {}, {}).size(), 3u);
}

TEST(Edges, AreNotMadeOfShading) {
  // A ball that is lit from the side: from 100 to 200 grey values over 60 px.
  PaddedImage image;
  image.resize(kSizePx, kSizePx);
  for (int y = 0; y < kSizePx; ++y) {
    for (int x = 0; x < kSizePx; ++x) {
      const double angle = std::clamp((x + 0.3 * y - 48.0) / 60.0, 0.0, 1.0) * std::numbers::pi;
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(150.0 - 50.0 * std::cos(angle)));
    }
  }
  add_noise(1.5, image);
  EdgeFinder finder;
  EXPECT_TRUE(finder.find(image, {}, {}).empty());
}

TEST(Edges, AreLinesThroughNoise) {
  const auto distance = [](double x, double y) { return 0.6 * (x - 60.3) + 0.8 * (y - 59.1); };
  PaddedImage image = make_step(distance);
  add_noise(2.0, image);
  EdgeFinder finder;
  const auto points = finder.find(image, {}, {});
  ASSERT_GT(points.size(), 8u);
  double squared_px = 0.0, squared_rad = 0.0;
  for (const EdgePoint& point : points) {
    squared_px += std::pow(distance(point.x_px, point.y_px), 2);
    squared_rad += std::pow(point.angle_rad - std::atan2(0.8, 0.6), 2);
  }
  const auto count = static_cast<double>(points.size());
  EXPECT_LT(std::sqrt(squared_px / count), 0.06);
  EXPECT_LT(std::sqrt(squared_rad / count), 0.025);
}

TEST(Edges, AreTheSteepestOfTheFreeCells) {
  constexpr int kColumns = kSizePx / EdgeFinder::kCellPx;
  EdgeFinder finder;
  const PaddedImage image = make_step([](double x, double) { return x - 60.0; });
  std::vector<std::uint8_t> is_free(kColumns * kColumns, 0);
  EXPECT_TRUE(finder.find(image, is_free, {}).empty());
  is_free[5 * kColumns + 7] = 1;
  const auto points = finder.find(image, is_free, {});
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(static_cast<int>(points[0].y_px) / EdgeFinder::kCellPx, 5);
  EXPECT_LE(finder.find(testing::make_texture(kSizePx, kSizePx, 1, 4), {}, {.count = 7}).size(),
            7u);
}

TEST(Edges, OfTinyImagesAreNone) {
  PaddedImage image;
  image.resize(9, 9);
  for (int y = 0; y < 9; ++y) std::fill_n(image.row(y), 9, 50);
  EXPECT_TRUE(EdgeFinder().find(image, {}, {}).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What surfaces look like: the canvas, marks on it, whole styles, and what a sensor makes of them.
#include "waymark/simulate/texture_drawing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "waymark/base/check.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

using Eigen::Vector2d;

int count_grey(const Image& image, int grey) {
  return static_cast<int>(std::count(image.values.begin(), image.values.end(), grey));
}

double mean_of(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t value : image.values) sum += value;
  return sum / static_cast<double>(image.values.size());
}

/// Root mean square difference of horizontal neighbours that are so many texels apart.
double contrast_at(const Image& image, int distance) {
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = distance; x < image.width_px; ++x, ++count) {
      sum += std::pow(image.view().at(x, y) - image.view().at(x - distance, y), 2);
    }
  }
  return std::sqrt(sum / count);
}

TEST(Canvas, HasTheTexelsThatItsSizeNeeds) {
  Canvas canvas({1.0, 0.5}, 0.1, 77);
  EXPECT_EQ(canvas.image().width_px, 10);
  EXPECT_EQ(canvas.image().height_px, 5);
  EXPECT_EQ(count_grey(canvas.image(), 77), 50);
  EXPECT_EQ(Canvas({0.01, 0.01}, 0.1, 0).image().width_px, 1);
  EXPECT_EQ(Canvas({0.11, 0.1}, 0.1, 0).image().width_px, 2);
}

TEST(Canvas, AreasFallOnTexelsAndAreCutOff) {
  Canvas canvas({1.0, 1.0}, 0.1, 0);
  canvas.fill_area({{0.2, 0.3}, {0.5, 0.4}}, 200);
  EXPECT_EQ(count_grey(canvas.image(), 200), 3);
  EXPECT_EQ(canvas.grey_at({0.25, 0.35}), 200);
  EXPECT_EQ(canvas.grey_at({0.15, 0.35}), 0);
  canvas.fill_area({{-5.0, 0.9}, {5.0, 7.0}}, 999);  // Clamped in place and grey.
  EXPECT_EQ(count_grey(canvas.image(), 255), 10);
  canvas.fill_area({{3.0, 3.0}, {4.0, 4.0}}, 100);
  canvas.fill_area({{-3.0, -3.0}, {-2.0, -2.0}}, 100);
  EXPECT_EQ(count_grey(canvas.image(), 100), 0);
  canvas.fill_area({{0.71, 0.01}, {0.72, 0.02}}, 50);  // Thinner than a texel.
  EXPECT_EQ(count_grey(canvas.image(), 50), 1);
}

TEST(Canvas, PolygonsAndCirclesCoverTheirArea) {
  Canvas canvas({2.0, 2.0}, 0.01, 0);
  const std::array<Vector2d, 3> triangle = {
      Vector2d(0.2, 0.2), Vector2d(1.2, 0.2), Vector2d(0.2, 1.2)};
  canvas.fill_polygon(triangle, 255);
  EXPECT_NEAR(mean_of(canvas.image()) / 255.0 * 4.0, 0.5, 0.04);
  Canvas other({2.0, 2.0}, 0.01, 0);
  other.fill_circle({1.0, 1.0}, 0.5, 255);
  EXPECT_NEAR(mean_of(other.image()) / 255.0 * 4.0, 0.785, 0.03);
  EXPECT_EQ(other.grey_at({1.0, 1.0}), 255);
  EXPECT_EQ(other.grey_at({1.0, 1.6}), 0);
  EXPECT_EQ(other.grey_at({-9.0, 99.0}), 0) << "the nearest texel";
  EXPECT_THROW(canvas.fill_polygon(std::span(triangle).first(2), 255), CheckError);
}

TEST(Canvas, LinesHaveTheirWidth) {
  const auto num_rows = [](double width_m) {
    Canvas canvas({1.0, 1.0}, 0.01, 0);
    canvas.draw_line({0.2, 0.5}, {0.8, 0.5}, width_m, 255);
    EXPECT_EQ(canvas.grey_at({0.05, 0.5}), 0);
    int count = 0;
    for (int y = 0; y < 100; ++y) count += canvas.image().view().at(50, y) > 128;
    return count;
  };
  // A few texels wider than asked for, for the soft edges.
  EXPECT_NEAR(num_rows(0.05), 5, 4);
  EXPECT_NEAR(num_rows(0.2), 20, 4);
  EXPECT_GE(num_rows(0.001), 1);
}

TEST(Marks, PolygonsCoverTheShareAskedFor) {
  for (const double coverage : {0.02, 0.1}) {
    Canvas canvas({4.0, 4.0}, 0.01, 128);
    Rng rng(3, 0);
    draw_polygons(canvas, canvas.area(), 0.1, coverage, 60, rng);
    const double covered = 1.0 - count_grey(canvas.image(), 128) / 160000.0;
    EXPECT_GT(covered, 0.4 * coverage);
    EXPECT_LT(covered, 1.6 * coverage);
  }
}

TEST(Marks, OctavesHaveMarksOfAllSizes) {
  Canvas canvas({2.0, 2.0}, 0.01, 128);
  Rng rng(3, 0);
  draw_octaves(canvas, canvas.area(), 0.4, 0.1, 60, rng);
  for (const int distance : {1, 4, 16}) EXPECT_GT(contrast_at(canvas.image(), distance), 5.0);
}

TEST(Marks, StayInTheirArea) {
  Canvas canvas({2.0, 2.0}, 0.01, 128);
  const Area area{{0.5, 0.5}, {1.5, 1.5}};
  Rng rng(5, 0);
  draw_text(canvas, area, 0.1, 10, rng);
  draw_posters(canvas, area, 4, 0.2, 0.3, rng);
  int num_inside = 0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      if (canvas.image().view().at(x, y) == 128) continue;
      const bool is_inside = x >= 45 && x < 155 && y >= 45 && y < 155;
      ASSERT_TRUE(is_inside) << x << ", " << y;
      ++num_inside;
    }
  }
  EXPECT_GT(num_inside, 1000);
}

TEST(Marks, TextTooSmallToBeSeenIsLeftOut) {
  Canvas canvas({1.0, 1.0}, 0.01, 128);
  Rng rng(5, 0);
  draw_text(canvas, canvas.area(), 0.02, 10, rng);
  EXPECT_EQ(count_grey(canvas.image(), 128), 10000);
}

TEST(Marks, CloudsAreSmoothAndKeepTheMean) {
  Canvas canvas({4.0, 4.0}, 0.02, 128);
  Rng rng(5, 0);
  draw_clouds(canvas, 1.0, 30.0, rng);
  EXPECT_NEAR(mean_of(canvas.image()), 128.0, 12.0);
  EXPECT_LT(contrast_at(canvas.image(), 1), 2.5);
  EXPECT_GT(contrast_at(canvas.image(), 50), 6.0);
}

class Styles : public ::testing::TestWithParam<int> {
 protected:
  static Image painted(std::uint64_t seed) {
    Rng rng(seed, 0);
    return paint(static_cast<Style>(GetParam()), {3.0, 2.5}, 0.01, rng);
  }
};

TEST_P(Styles, AreRichAndDifferFromSeedToSeed) {
  const Image image = painted(1);
  EXPECT_EQ(image.width_px, 300);
  EXPECT_EQ(image.height_px, 250);
  EXPECT_EQ(image.values, painted(1).values);
  EXPECT_NE(image.values, painted(2).values);
  const auto style = static_cast<Style>(GetParam());
  const bool is_bare = style == Style::kBare || style == Style::kBlank;
  const double contrast = contrast_at(image, 3);
  EXPECT_TRUE(is_bare ? contrast < 10.0 : contrast > 4.0) << contrast;
  EXPECT_GT(mean_of(image), 30.0);
  EXPECT_LT(mean_of(image), 220.0);
}

INSTANTIATE_TEST_SUITE_P(All, Styles, ::testing::Range(0, static_cast<int>(Style::kMetal) + 1));

TEST(Effects, GainSaturates) {
  Image image(3, 1);
  image.values = {0, 100, 200};
  Rng rng(1, 0);
  apply_exposure({.gain = 1.5}, rng, image);
  EXPECT_EQ(image.values, (std::vector<std::uint8_t>{0, 150, 255}));
  const Image before = image;
  apply_exposure({}, rng, image);
  EXPECT_EQ(image.values, before.values);
}

TEST(Effects, DepthNoiseLeavesNothingImpossible) {
  DepthImage depth(2000, 1);
  std::fill(depth.values.begin(), depth.values.end(), std::uint16_t{30000});  // 30 m.
  depth.values[7] = 0;
  Rng rng(1, 0);
  apply_depth_noise({.inverse_depth_sigma = 0.02}, 1000.0, rng, depth);
  EXPECT_EQ(depth.values[7], 0) << "not measured";
  std::map<bool, int> is_measured;
  double sum = 0.0;
  for (const std::uint16_t value : depth.values) {
    ++is_measured[value > 0];
    if (value > 0) sum += 1000.0 / value;
  }
  // The noise is 0.6 of the inverse depth: some end behind infinity or beyond 65 m.
  EXPECT_GT(is_measured[false], 50);
  EXPECT_GT(is_measured[true], 1000);
  EXPECT_GT(sum / is_measured[true], 1.0 / 30.0) << "those that are left are the nearer ones";
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/image_statistics.h"

#include <gtest/gtest.h>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

/// Squares of 8 px of random grey values from low to high.
Image make_squares(int low, int high) {
  Image image(320, 240);
  Rng rng(7, 1);
  std::vector<int> greys(40 * 30);
  for (int& grey : greys) {
    grey = low + static_cast<int>(rng.below(static_cast<std::uint32_t>(high - low + 1)));
  }
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const auto square = static_cast<std::size_t>(y / 8 * 40 + x / 8);
      image.row(y)[x] = static_cast<std::uint8_t>(greys[square]);
    }
  }
  return image;
}

/// The mean over so many pixels along rows.
Image smeared(const Image& image, int length) {
  Image result(image.width_px, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      int sum = 0;
      for (int i = 0; i < length; ++i) sum += image.row(y)[(x + i) % image.width_px];
      result.row(y)[x] = static_cast<std::uint8_t>(sum / length);
    }
  }
  return result;
}

TEST(ImageStatistics, BrightnessAndContrastAreThoseOfTheGreyValues) {
  const ImageStatistics bright = measure_image(make_squares(40, 200).view());
  EXPECT_TRUE(bright.is_known);
  EXPECT_NEAR(bright.brightness, 120, 6);
  EXPECT_NEAR(bright.contrast, 46, 4);  // 160 / sqrt(12).
  const ImageStatistics dark = measure_image(make_squares(10, 30).view());
  EXPECT_NEAR(dark.brightness, 20, 2);
  EXPECT_NEAR(dark.contrast, 6, 2);
}

TEST(ImageStatistics, MotionBlursAlongRowsOrColumns) {
  const Image sharp = make_squares(40, 200);
  const int blur = measure_image(sharp.view()).blur_percent;
  const int little = measure_image(smeared(sharp, 5).view()).blur_percent;
  const int much = measure_image(smeared(sharp, 15).view()).blur_percent;
  EXPECT_LT(blur, 40);
  EXPECT_GT(little, blur + 5);
  EXPECT_GT(much, little + 10);
}

TEST(ImageStatistics, OneGreyValueIsAllBlur) {
  const Image image = make_squares(90, 90);
  EXPECT_EQ(measure_image(image.view()).contrast, 0);
  EXPECT_EQ(measure_image(image.view()).blur_percent, 100);
}

TEST(ImageStatistics, TooSmallIsUnknown) {
  EXPECT_FALSE(measure_image({}).is_known);
  const Image image(22, 200);
  EXPECT_FALSE(measure_image(image.view()).is_known);
}

}  // namespace
}  // namespace waymark

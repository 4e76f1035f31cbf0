// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "waymark/base/rng.h"
#include "waymark/image/convert.h"

namespace waymark {
namespace {

Image random_area(int width_px, int height_px) {
  Rng rng(1, 0);
  Image image(width_px, height_px);
  for (std::uint8_t& value : image.values) value = static_cast<std::uint8_t>(rng.below(256));
  return image;
}

TEST(Reduce, IsTheMeanOfAreasAsInOpenCv) {
  const Image image = random_area(150, 90);
  for (const double factor : {0.5, 0.4, 2.0 / 3.0, 1.0 / 3.0, 0.1}) {
    const Image reduced = reduce(image.view(), factor);
    const cv::Mat source(90, 150, CV_8U, const_cast<std::uint8_t*>(image.values.data()));
    cv::Mat expected;
    cv::resize(
        source, expected, cv::Size(reduced.width_px, reduced.height_px), 0, 0, cv::INTER_AREA);
    ASSERT_EQ(reduced.width_px, static_cast<int>(150 * factor));
    for (int y = 0; y < reduced.height_px; ++y) {
      for (int x = 0; x < reduced.width_px; ++x) {
        ASSERT_NEAR(reduced.row(y)[x], expected.at<std::uint8_t>(y, x), 1) << x << ", " << y;
      }
    }
  }
}

TEST(Reduce, RoundsTheSizeDownAndKeepsTheCorner) {
  Image image(11, 7);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 11; ++x) image.row(y)[x] = static_cast<std::uint8_t>(20 * x);
  }
  const Image reduced = reduce(image.view(), 0.5);
  EXPECT_EQ(reduced.width_px, 5);
  EXPECT_EQ(reduced.height_px, 3);
  for (int x = 0; x < 5; ++x) EXPECT_EQ(reduced.row(2)[x], 40 * x + 10);
}

TEST(Reduce, PickedValuesAreThoseOfTheImage) {
  DepthImage depth(10, 10);
  for (std::size_t i = 0; i < depth.values.size(); ++i) {
    depth.values[i] = static_cast<std::uint16_t>(i % 3 == 0 ? 0 : 1000);
  }
  const DepthImage picked = pick_reduced(depth.view(), 0.3);
  EXPECT_EQ(picked.width_px, 3);
  for (const std::uint16_t value : picked.values) EXPECT_TRUE(value == 0 || value == 1000);
  EXPECT_EQ(pick_reduced(random_area(10, 10).view(), 0.3).height_px, 3);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/color.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

TEST(Color, GreyIsWhatOpenCvMakesOfIt) {
  constexpr int kWidth = 67, kHeight = 41, kLeft = 3, kUsedWidth = 60;
  ColorImage image(kWidth, kHeight);
  Rng rng(0, 0);
  for (Rgb& value : image.values) {
    for (std::uint8_t& channel : value) channel = static_cast<std::uint8_t>(rng.below(256));
  }
  const ColorView part{image.row(0) + kLeft, kUsedWidth, kHeight, kWidth};
  cv::Mat expected;
  cv::cvtColor(
      cv::Mat(kHeight, kWidth, CV_8UC3, image.values.data()).colRange(kLeft, kLeft + kUsedWidth),
      expected,
      cv::COLOR_RGB2GRAY);
  const Image grey = to_grey(part);
  ASSERT_EQ(grey.width_px, kUsedWidth);
  ASSERT_EQ(grey.height_px, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kUsedWidth; ++x) {
      ASSERT_EQ(grey.row(y)[x], expected.at<std::uint8_t>(y, x)) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace waymark

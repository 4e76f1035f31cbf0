// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

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

TEST(DepthUnits, RoundsAndLeavesOutWhatIsNoMeasurement) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  // Rows of five with one between them that is not part of the image.
  const std::vector<float> metres = {1.0f,
                                     2.00011f,
                                     0.00009f,
                                     0.0f,
                                     -1.0f,
                                     9.0f,  //
                                     kNan,
                                     kInfinity,
                                     13.107f,
                                     13.1072f,
                                     -kInfinity,
                                     9.0f};
  const DepthImage depth =
      depth_in_units({metres.data(), 5, 2, 6}, DepthSettings{.factor = 5000.0});
  EXPECT_EQ(depth.width_px, 5);
  EXPECT_EQ(depth.height_px, 2);
  EXPECT_THAT(depth.values, ::testing::ElementsAre(5000, 10001, 0, 0, 0, 0, 0, 65535, 0, 0));
}

}  // namespace
}  // namespace waymark

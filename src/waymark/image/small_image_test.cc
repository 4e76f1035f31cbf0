// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/small_image.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(SmallImage, HasAtMost80PixelsToASideAndTheMeansOfSquares) {
  Image image(645, 480);
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(x / 9 + y / 9 + (x + y) % 2);
    }
  }
  EXPECT_DOUBLE_EQ(small_image_factor(645, 480), 1.0 / 9.0);
  EXPECT_DOUBLE_EQ(small_image_factor(480, 640), 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(small_image_factor(60, 40), 1.0);
  const SmallImage small = make_small_image(image.view(), {});
  EXPECT_EQ(small.grey.width_px, 71);
  EXPECT_EQ(small.grey.height_px, 53);
  EXPECT_TRUE(small.mask.values.empty());
  EXPECT_NEAR(small.grey.row(20)[30], 50.5, 0.6);
}

TEST(SmallImage, KeepsTheMask) {
  Image mask(160, 120);
  for (int y = 0; y < mask.height_px; ++y) mask.row(y)[100] = mask.row(y)[101] = 8;
  const SmallImage small = make_small_image(Image(160, 120).view(), mask.view());
  ASSERT_EQ(small.mask.width_px, 80);
  EXPECT_EQ(small.mask.row(3)[50], 8);
  EXPECT_EQ(small.mask.row(3)[49], 0);
}

}  // namespace
}  // namespace waymark

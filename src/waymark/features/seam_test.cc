// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/camera/equirectangular.h"
#include "waymark/features/frame_builder.h"
#include "waymark/features/hamming.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kPanoramaWidth = 640;
constexpr int kPanoramaHeight = 320;

TEST(SeamPadding, RepeatsColumnsAtBothSides) {
  const PaddedImage image = testing::make_noise(50, 7, 1);
  SeamPadding padding(9);
  const ImageView wide = padding.widen(image.view());
  ASSERT_EQ(wide.width_px, 68);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 68; ++x) EXPECT_EQ(wide.at(x, y), image.row(y)[(x - 9 + 50) % 50]);
  }
  const ImageView mask = padding.widen_mask({}, 50, 7, 8);
  for (int x = 0; x < 68; ++x) EXPECT_EQ(mask.at(x, 3), x >= 9 && x < 59 ? 8 : 0);
}

/// A texture without a seam, turned to the left by some columns.
PaddedImage turned(const PaddedImage& image, int shift) {
  PaddedImage result;
  result.resize(image.width_px(), image.height_px());
  for (int y = 0; y < image.height_px(); ++y) {
    std::copy_n(image.row(y), image.width_px(), result.row(y));
    std::rotate(result.row(y), result.row(y) + shift, result.row(y) + image.width_px());
  }
  return result;
}

std::shared_ptr<const Features> features_of(const PaddedImage& image) {
  const auto camera = std::make_shared<EquirectangularCamera>(
      EquirectangularModel(kPanoramaWidth, kPanoramaHeight), kPanoramaWidth, kPanoramaHeight);
  FrameBuilder builder({{{camera, Rigid3()}}}, {.features = {.count = 8000}});
  return builder.build({.image0 = image.view()});
}

TEST(FrameBuilder, FindsAndDescribesFeaturesAtTheSeamLikeOthers) {
  const PaddedImage texture = testing::make_texture(kPanoramaWidth, kPanoramaHeight, 3);
  // Half a turn: what was at the seam is in the middle. Pyramid pixels fall elsewhere, hence only
  // features of level 0 are the same bit for bit.
  const auto at_seam = features_of(texture);
  const auto in_middle = features_of(turned(texture, kPanoramaWidth / 2));
  int num_near_seam = 0, num_found = 0;
  for (std::size_t i = 0; i < at_seam->num_primary; ++i) {
    const Keypoint& a = at_seam->keypoints[i];
    EXPECT_GE(a.x_px, -0.5f);
    EXPECT_LT(a.x_px, kPanoramaWidth - 0.5f);
    if (a.level != 0 || std::min(a.x_px, kPanoramaWidth - a.x_px) > 18.0f) continue;
    ++num_near_seam;
    const float expected_x =
        a.x_px < 100.0f ? a.x_px + kPanoramaWidth / 2 : a.x_px - kPanoramaWidth / 2;
    for (std::size_t k = 0; k < in_middle->num_primary; ++k) {
      const Keypoint& b = in_middle->keypoints[k];
      if (b.level != 0 || std::hypot(b.x_px - expected_x, b.y_px - a.y_px) > 0.01f) continue;
      num_found += hamming_distance(at_seam->descriptors[i], in_middle->descriptors[k]) == 0;
    }
  }
  // There is room for every corner.
  EXPECT_GT(num_near_seam, 20);
  EXPECT_GE(num_found, num_near_seam * 9 / 10);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/view_mask.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/features/frame_builder.h"
#include "waymark/features/pyramid.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kViewSizePx = 400;
constexpr double kCenterPx = 200.0;

/// 100 pixels per radian: covers 229 degrees at the borders.
std::shared_ptr<const Camera> make_fisheye(double k1 = 0.0) {
  const ImagePlane plane{{100.0, 100.0}, {kCenterPx, kCenterPx}};
  return std::make_shared<FisheyeCamera>(
      FisheyeModel(plane, {k1, 0.0, 0.0, 0.0}), kViewSizePx, kViewSizePx);
}

/// Texture within a circle, black with a little noise outside.
PaddedImage make_vignetted(double radius_px) {
  PaddedImage image = testing::make_texture(kViewSizePx, kViewSizePx, 4);
  const PaddedImage noise = testing::make_noise(kViewSizePx, kViewSizePx, 5);
  for (int y = 0; y < kViewSizePx; ++y) {
    for (int x = 0; x < kViewSizePx; ++x) {
      std::uint8_t& value = image.row(y)[x];
      value = std::max<std::uint8_t>(value, 30);
      if (std::hypot(x - kCenterPx, y - kCenterPx) > radius_px) value = noise.row(y)[x] % 12;
    }
  }
  return image;
}

TEST(DistanceTransform, EqualsExhaustiveSearch) {
  PaddedImage image = testing::make_noise(41, 23, 6);
  std::vector<std::pair<int, int>> zeros;
  for (int y = 0; y < 23; ++y) {
    for (int x = 0; x < 41; ++x) {
      std::uint8_t& value = image.row(y)[x];
      value = value < 4 || (x == 3 && y > 15) ? 0 : 1;
      if (value == 0) zeros.emplace_back(x, y);
    }
  }
  const std::vector<float> distances = distances_to_zero(image.view());
  for (int y = 0; y < 23; ++y) {
    for (int x = 0; x < 41; ++x) {
      double nearest = INFINITY;
      for (const auto& [zero_x, zero_y] : zeros) {
        nearest = std::min(nearest, std::hypot(x - zero_x, y - zero_y));
      }
      EXPECT_NEAR(distances[static_cast<std::size_t>(41 * y + x)], nearest, 1e-5);
    }
  }
  const Image ones = [] {
    Image result(5, 4);
    std::fill(result.values.begin(), result.values.end(), std::uint8_t{1});
    return result;
  }();
  for (const float distance : distances_to_zero(ones.view())) EXPECT_TRUE(std::isinf(distance));
}

TEST(ViewMask, PlainCamerasHaveNoLimits) {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({300.0, 300.0}, {159.5, 119.5}), 320, 240);
  ViewMask mask(camera, {});
  PaddedImage black;
  black.resize(320, 240);
  for (int y = 0; y < 240; ++y) std::fill_n(black.row(y), 320, std::uint8_t{0});
  mask.learn(black.view());
  EXPECT_TRUE(mask.levels().is_empty());
  EXPECT_TRUE(mask.levels().allows({0.0, 0.0}, 7));
}

TEST(ViewMask, KeepsPatchesClearOfPixelsWithoutBearing) {
  // Folds at sqrt(0.95 / 0.3) rad, where the radius is 1.216.
  ViewMask mask(make_fisheye(-0.1), {});
  for (int level = 0; level < Pyramid::kNumLevels; ++level) {
    const double last = 121.6 - 19.0 * Pyramid::scale(level);
    EXPECT_TRUE(mask.levels().allows({kCenterPx + last - 2.0, kCenterPx}, level)) << level;
    EXPECT_FALSE(mask.levels().allows({kCenterPx, kCenterPx - last - 2.0}, level)) << level;
  }
}

TEST(ViewMask, FindsTheImageCircle) {
  ViewMask mask(make_fisheye(), {});
  EXPECT_TRUE(mask.levels().is_empty());
  PaddedImage black;
  black.resize(kViewSizePx, kViewSizePx);
  for (int y = 0; y < kViewSizePx; ++y) std::fill_n(black.row(y), kViewSizePx, std::uint8_t{3});
  mask.learn(black.view());  // The lid is still on.
  EXPECT_TRUE(mask.levels().is_empty());
  mask.learn(make_vignetted(150.0).view());
  mask.learn(make_vignetted(170.0).view());  // The first image was dark at the border.
  EXPECT_TRUE(mask.levels().allows({kCenterPx + 170.0 - 25.0, kCenterPx}, 0));
  EXPECT_FALSE(mask.levels().allows({kCenterPx + 170.0 - 19.0, kCenterPx}, 0));
  mask.learn(testing::make_texture(kViewSizePx, kViewSizePx, 4).view());
  EXPECT_TRUE(mask.levels().is_empty());
}

TEST(ViewMask, CombinesWithAnotherMask) {
  ViewMask mask(make_fisheye(-0.1), {});
  Image other(kViewSizePx, kViewSizePx);
  std::fill_n(other.values.begin(), kViewSizePx * kViewSizePx / 2, std::uint8_t{1});
  Image buffer;
  const ImageView combined = mask.levels().combined_with(other.view(), buffer);
  EXPECT_EQ(combined.at(200, 190), Pyramid::kNumLevels);
  EXPECT_EQ(combined.at(200, 210), 0);
  EXPECT_EQ(combined.at(2, 2), 0);
}

TEST(ViewMask, ExcludesDirections) {
  const auto camera =
      std::make_shared<EquirectangularCamera>(EquirectangularModel(720, 360), 720, 360);
  ViewMask poles(camera, {.top_deg = 10.0, .bottom_deg = 30.0});
  EXPECT_FALSE(poles.levels().allows({100.0, 18.0}, 0));
  EXPECT_TRUE(poles.levels().allows({100.0, 21.0}, 7));
  EXPECT_TRUE(poles.levels().allows({600.0, 298.0}, 7));
  EXPECT_FALSE(poles.levels().allows({600.0, 301.0}, 0));
  ViewMask narrow(make_fisheye(), {.max_angle_deg = 90.0});
  const double edge = 100.0 * std::numbers::pi / 2.0;
  EXPECT_TRUE(narrow.levels().allows({kCenterPx, kCenterPx + edge - 1.0}, 7));
  EXPECT_FALSE(narrow.levels().allows({kCenterPx, kCenterPx + edge + 1.0}, 0));
}

TEST(FrameBuilder, KeepsTheVignetteFreeOfFeatures) {
  FrameBuilder builder({{{make_fisheye(), Rigid3()}}}, {.features = {.count = 500}});
  const PaddedImage image = make_vignetted(150.0);
  const auto features = builder.build({.image0 = image.view()});
  EXPECT_GT(features->num_primary, 300u);
  for (const Keypoint& keypoint : features->keypoints) {
    const double clearance =
        150.0 - std::hypot(keypoint.x_px - kCenterPx, keypoint.y_px - kCenterPx);
    EXPECT_GT(clearance, 18.0 * Pyramid::scale(keypoint.level));
  }
}

}  // namespace
}  // namespace waymark

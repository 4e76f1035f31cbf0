// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/feature_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/camera/perspective.h"
#include "waymark/image/frame_builder.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

Rig make_rig() {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({300.0, 300.0}, {159.5, 119.5}, std::vector{-0.1, 0.01, 0.0, 0.0}),
      320,
      240);
  const Rigid3 cam1_from_rig(Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0});
  return {{{camera, Rigid3()}, {camera, cam1_from_rig}}};
}

TEST(FeatureGeometry, IsThatOfFramesFromImages) {
  const PaddedImage texture = testing::make_texture(332, 240, 5);
  const ImageView left{texture.row(0), 320, 240, texture.stride()};
  const ImageView right{texture.row(0) + 12, 320, 240, texture.stride()};
  FrameBuilder builder(make_rig(), {.features = {.count = 300}});
  const auto built = builder.build({.image0 = left, .image1 = right});
  ASSERT_GT(built->size(), built->num_primary);

  Features derived;
  derived.num_primary = built->num_primary;
  derived.keypoints = built->keypoints;
  const std::vector<std::uint8_t> is_valid = derive_geometry(make_rig(), derived);
  EXPECT_EQ(std::count(is_valid.begin(), is_valid.end(), 1), std::ptrdiff_t(built->size()));
  for (std::uint32_t i = 0; i < derived.size(); ++i) {
    const float tolerance = i < derived.num_primary ? 0.0f : 1e-6f;
    const Matrix23f& w = built->level_pixel_from_bearing[i];
    EXPECT_LE((derived.bearings[i] - built->bearings[i]).norm(), tolerance);
    EXPECT_LE((derived.level_pixel_from_bearing[i] - w).norm(), tolerance * w.norm());
    EXPECT_LE(std::abs(derived.size_rad[i] / built->size_rad[i] - 1.0f), tolerance);
  }
  for (std::uint32_t i = 0; i < derived.num_primary; ++i) {
    const Keypoint& keypoint = derived.keypoints[i];
    int num_found = 0;
    derived.grid.visit_near(
        keypoint.x_px, keypoint.y_px, 1.0, [&](std::uint32_t found) { num_found += found == i; });
    EXPECT_EQ(num_found, 1);
  }
}

TEST(FeatureGeometry, SaysWhichPixelsHaveNoBearing) {
  Features features;
  features.keypoints = {{.x_px = 160.0f, .y_px = 120.0f}, {.x_px = 1e6f, .y_px = 120.0f}};
  features.num_primary = 2;
  EXPECT_EQ(derive_geometry(make_rig(), features), (std::vector<std::uint8_t>{1, 0}));
}

}  // namespace
}  // namespace waymark

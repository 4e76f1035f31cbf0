// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/frame_builder.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/camera/perspective.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kFrameWidth = 320;
constexpr int kFrameHeight = 240;
constexpr int kDisparityPx = 12;
constexpr double kFocalPx = 300.0;

std::shared_ptr<const Camera> make_camera(std::vector<double> distortion = {}) {
  return std::make_shared<PerspectiveCamera>(
      PerspectiveModel({kFocalPx, kFocalPx}, {159.5, 119.5}, distortion),
      kFrameWidth,
      kFrameHeight);
}

Rig make_stereo_rig() {
  const Rigid3 cam1_from_rig(Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0});
  return {{{make_camera(), Rigid3()}, {make_camera(), cam1_from_rig}}};
}

/// Two windows of one texture, kDisparityPx apart: a wall at 2.5 m.
struct StereoImages {
  PaddedImage texture = testing::make_texture(kFrameWidth + kDisparityPx, kFrameHeight, 5);

  ImageView left() const { return {texture.row(0), kFrameWidth, kFrameHeight, texture.stride()}; }
  ImageView right() const {
    return {texture.row(0) + kDisparityPx, kFrameWidth, kFrameHeight, texture.stride()};
  }
};

void expect_parallel_arrays(const Features& features) {
  const std::size_t count = features.keypoints.size();
  EXPECT_EQ(features.bearings.size(), count);
  EXPECT_EQ(features.level_pixel_from_bearing.size(), count);
  EXPECT_EQ(features.size_rad.size(), count);
  EXPECT_EQ(features.partner.size(), count);
  EXPECT_EQ(features.descriptors.size(), features.num_primary);
  EXPECT_EQ(features.range_m.size(), features.num_primary);
  EXPECT_EQ(features.inverse_range_sigma.size(), features.num_primary);
}

TEST(FrameBuilder, MonoHasNoRanges) {
  const StereoImages images;
  FrameBuilder builder({{{make_camera(), Rigid3()}}}, {.features = {.count = 300}});
  const auto features = builder.build({.image0 = images.left()});
  EXPECT_GT(features->num_primary, 200u);
  EXPECT_EQ(features->num_primary, features->size());
  expect_parallel_arrays(*features);
  for (std::size_t i = 0; i < features->size(); ++i) {
    EXPECT_EQ(features->partner[i], kNoFeature);
    EXPECT_EQ(features->range_m[i], 0.0f);
  }
}

TEST(FrameBuilder, GridFindsEachPrimaryFeature) {
  const StereoImages images;
  FrameBuilder builder(make_stereo_rig(), {.features = {.count = 300}});
  const auto features = builder.build({.image0 = images.left(), .image1 = images.right()});
  ASSERT_GT(features->num_primary, 200u);
  for (std::uint32_t i = 0; i < features->num_primary; ++i) {
    const Keypoint& keypoint = features->keypoints[i];
    int num_found = 0;
    features->grid.visit_near(keypoint.x_px, keypoint.y_px, 1.0, [&](std::uint32_t index) {
      EXPECT_LT(index, features->num_primary);
      num_found += index == i;
    });
    EXPECT_EQ(num_found, 1);
  }
}

TEST(FrameBuilder, StereoAddsPartnersOfCameraOne) {
  const StereoImages images;
  FrameBuilder builder(make_stereo_rig(), {.features = {.count = 300}});
  const auto features = builder.build({.image0 = images.left(), .image1 = images.right()});
  expect_parallel_arrays(*features);
  ASSERT_GT(features->size(), features->num_primary * 17 / 10);
  const double depth_m = kFocalPx * 0.1 / kDisparityPx;
  std::size_t num_right = 0;
  for (std::uint32_t second = features->num_primary; second < features->size(); ++second) {
    const std::uint32_t first = features->partner[second];
    ASSERT_LT(first, features->num_primary);
    EXPECT_EQ(features->partner[first], second);
    const Keypoint& a = features->keypoints[first];
    const Keypoint& b = features->keypoints[second];
    EXPECT_EQ(a.camera, 0);
    EXPECT_EQ(b.camera, 1);
    EXPECT_NEAR(features->bearings[second].norm(), 1.0f, 1e-6f);
    EXPECT_EQ(a.level, b.level);
    const Eigen::Vector2d error(a.x_px - b.x_px - kDisparityPx, a.y_px - b.y_px);
    if (error.norm() > 0.2 * Pyramid::scale(a.level)) continue;
    ++num_right;
    EXPECT_NEAR(features->range_m[first] * features->bearings[first].z(), depth_m, 0.2);
  }
  EXPECT_GT(num_right, (features->size() - features->num_primary) * 97 / 100);
}

TEST(FrameBuilder, DepthImageGivesRangeAndSigma) {
  const StereoImages images;
  DepthImage depth(kFrameWidth, kFrameHeight);
  std::fill(depth.values.begin(), depth.values.end(), std::uint16_t{4000});
  FrameBuilder builder({{{make_camera(), Rigid3()}}},
                       {.features = {.count = 300}, .depth = {.factor = 2000.0}});
  const auto features = builder.build({.image0 = images.left(), .depth = depth.view()});
  expect_parallel_arrays(*features);
  for (std::size_t i = 0; i < features->num_primary; ++i) {
    EXPECT_NEAR(features->range_m[i] * features->bearings[i].z(), 2.0f, 1e-3f);
    EXPECT_GT(features->inverse_range_sigma[i], 0.0f);
  }
}

TEST(FrameBuilder, ReadsDepthWhereFeaturesWereThen) {
  const StereoImages images;
  DepthImage ramp(kFrameWidth, kFrameHeight);
  for (int v = 0; v < kFrameHeight; ++v) {
    for (int u = 0; u < kFrameWidth; ++u) ramp.row(v)[u] = static_cast<std::uint16_t>(2000 + u);
  }
  FrameBuilder builder({{{make_camera(), Rigid3()}}}, {.features = {.count = 300}});
  FrameImages input{.image0 = images.left(), .depth = ramp.view()};
  EXPECT_FALSE(builder.needs_motion(input));
  input.depth_lag_ns = 20'000'000;
  EXPECT_TRUE(builder.needs_motion(input));
  RigMotion motion;
  motion.turn_rad_s = {0.0f, 1.0f, 0.0f};  // At least 6 px to the right.
  const auto at_once = builder.build(input);
  const auto later = builder.build(input, motion);
  ASSERT_EQ(later->size(), at_once->size());
  int num_right = 0;
  for (std::size_t i = 0; i < later->size(); ++i) {
    EXPECT_EQ(later->keypoints[i].x_px, at_once->keypoints[i].x_px) << "a global shutter";
    const Eigen::Vector3f bearing = at_once->bearings[i];
    const Eigen::Vector3f then = (bearing + 0.02f * motion.turn_rad_s.cross(bearing)).normalized();
    const double column_px = 159.5 + kFocalPx * then.x() / then.z();
    num_right += std::abs(later->range_m[i] - (2.0 + 1e-3 * column_px) / then.z()) < 2e-3;
  }
  EXPECT_GT(num_right, static_cast<int>(later->size() * 9 / 10));
}

TEST(FrameBuilder, TakesRangesBackToTheTimeOfTheFrame) {
  const StereoImages images;
  DepthImage wall(kFrameWidth, kFrameHeight);
  std::fill(wall.values.begin(), wall.values.end(), std::uint16_t{4000});
  FrameBuilder builder({{{make_camera(), Rigid3()}}}, {.features = {.count = 300}});
  FrameImages input{.image0 = images.left(), .depth = wall.view(), .depth_lag_ns = 20'000'000};
  RigMotion motion;
  motion.shift_per_s = {0.0f, 0.0f, -1.0f};  // Towards the wall.
  const auto features = builder.build(input, motion);
  ASSERT_GT(features->size(), 200u);
  for (std::size_t i = 0; i < features->size(); ++i) {
    const float z = features->bearings[i].z();
    EXPECT_NEAR(features->range_m[i], 4.0f / z + 0.02f * z, 2e-3f);
  }
}

TEST(FrameBuilder, ChoosesFeaturesWithBearings) {
  // Strong distortion: the corners of the image lie outside the model's field of view.
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({150.0, 150.0}, {159.5, 119.5}, std::vector<double>{-0.28, 0.0, 0.0, 0.0}),
      kFrameWidth,
      kFrameHeight);
  const StereoImages images;
  FrameBuilder wide({{{camera, Rigid3()}}}, {.features = {.count = 300}});
  const auto features = wide.build({.image0 = images.left()});
  EXPECT_EQ(features->num_primary, 300u);
  expect_parallel_arrays(*features);
  for (const Keypoint& keypoint : features->keypoints) {
    EXPECT_LT(std::hypot(keypoint.x_px - 159.5, keypoint.y_px - 119.5), 0.73 * 150.0);
  }
}

TEST(FrameBuilder, SameImagesGiveTheSameFrame) {
  const StereoImages images;
  const FrameImages input{.image0 = images.left(), .image1 = images.right()};
  FrameBuilder builder(make_stereo_rig(), {.features = {.count = 300}});
  const auto first = builder.build(input);
  const auto second = builder.build(input);
  EXPECT_EQ(first->descriptors, second->descriptors);
  EXPECT_EQ(first->bearings, second->bearings);
  EXPECT_EQ(first->range_m, second->range_m);
}

TEST(FrameBuilder, RefusesImagesOfAnotherSize) {
  const StereoImages images;
  ImageView small = images.right();
  small.height_px -= 1;
  FrameBuilder builder(make_stereo_rig(), {.features = {.count = 300}});
  EXPECT_THROW(builder.build({.image0 = small}), InputError);
  EXPECT_THROW(builder.build({.image0 = images.left(), .image1 = small}), InputError);
  EXPECT_THROW(builder.build({.image0 = images.left(), .mask = small}), InputError);
}

}  // namespace
}  // namespace waymark

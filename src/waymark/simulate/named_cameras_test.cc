// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/named_cameras.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/camera/testing/camera_test.h"
#include "waymark/features/frame_builder.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

class NamedCamera : public ::testing::TestWithParam<std::string> {};

TEST_P(NamedCamera, IsSoundAndSeesTheWorld) {
  const auto camera =
      CameraRegistry::with_builtin_models().make_camera(named_camera(GetParam(), 160));
  expect_camera_is_sound(*camera);
  const Renderer renderer(make_world("room", 1), camera);
  ThreadPool pool(2);
  const Image image = renderer.image(make_motion("room", "loop", 10.0).world_from_rig(2.0), pool);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < image.width_px * image.height_px; ++i) {
    pixels.emplace_back(i % image.width_px, i / image.width_px);
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera->unproject(pixels, bearings, is_valid);
  int num_black = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    num_black += image.values[i] == 0;
    if (!is_valid[i]) {
      EXPECT_EQ(image.values[i], 0) << pixels[i].transpose();
    }
  }
  // At the border of the field of view a pixel's corner may have no ray.
  const auto num_invalid = std::count(is_valid.begin(), is_valid.end(), 0);
  EXPECT_LE(num_black, num_invalid + 8 * image.height_px);
}

INSTANTIATE_TEST_SUITE_P(All, NamedCamera, ::testing::ValuesIn(camera_names()));

TEST(NamedCamera, VignetteHasNoFeatures) {
  const auto camera =
      CameraRegistry::with_builtin_models().make_camera(named_camera("fisheye_200", 320));
  const Renderer renderer(make_world("room", 1), camera);
  ThreadPool pool(2);
  FrameBuilder builder({{{camera, Rigid3()}}}, {.features = {.count = 500}});
  const Image image = renderer.image(make_motion("room", "loop", 10.0).world_from_rig(2.0), pool);
  const auto features = builder.build({.image0 = image.view()});
  EXPECT_GT(features->num_primary, 300u);
  // The radius where the polynomial folds, 0.39 of the height per radian.
  const double radius_px = 0.39 * 320 * (1.85 - 0.0925 * std::pow(1.85, 3));
  for (const Keypoint& keypoint : features->keypoints) {
    EXPECT_LT(std::hypot(keypoint.x_px - 160.3, keypoint.y_px - 158.9), radius_px - 18.0);
  }
}

TEST(NamedCamera, UnknownNamesAreRefused) { EXPECT_THROW(named_camera("fish", 100), InputError); }

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/resized_camera.h"

#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/testing/camera_test.h"

namespace waymark {
namespace {

const std::vector<double> kCoeffs = {-0.2, 0.05, 3e-4, -2e-4};

TEST(ResizedCamera, IsSound) {
  const ImagePlane plane{{191.0, 190.5}, {254.9, 256.8}};
  const auto fisheye =
      std::make_shared<FisheyeCamera>(FisheyeModel(plane, {3.5e-3, 7e-4, -2e-3, 2e-4}), 512, 512);
  expect_camera_is_sound(ResizedCamera(fisheye, 0.5));
  expect_camera_is_sound(ResizedCamera(fisheye, 0.37));
}

TEST(ResizedCamera, IsTheCameraOfTheSmallerImage) {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({400.0, 402.0}, {319.5, 239.5}, kCoeffs), 640, 480);
  // Centre stays centre: pixel 319.5 of 640 columns is 127.5 of 256.
  const PerspectiveCamera smaller(
      PerspectiveModel({160.0, 160.8}, {127.5, 95.5}, kCoeffs), 256, 192);
  const ResizedCamera resized(camera, 0.4);
  EXPECT_EQ(resized.width_px(), 256);
  EXPECT_EQ(resized.height_px(), 192);
  const std::vector<Eigen::Vector3d> points = random_points_for_test(2000, 9);
  const CameraTestProjection a = project_for_test(resized, points);
  const CameraTestProjection b = project_for_test(smaller, points);
  int num_seen = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(a.is_visible[i], b.is_visible[i]);
    if (!a.is_visible[i]) continue;
    ++num_seen;
    EXPECT_LT((a.pixels[i] - b.pixels[i]).norm(), 1e-9);
  }
  EXPECT_GT(num_seen, 100);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/scaled_camera.h"

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/testing/camera_test.h"

namespace waymark {
namespace {

const std::vector<double> kCoeffs = {-0.2, 0.05, 3e-4, -2e-4};

/// Pixels of a and b are the same wherever both see random points.
void expect_same_pixels(const Camera& a, const Camera& b) {
  const std::vector<Eigen::Vector3d> points = random_points_for_test(2000, 9);
  const CameraTestProjection in_a = project_for_test(a, points);
  const CameraTestProjection in_b = project_for_test(b, points);
  int num_seen = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!in_a.is_visible[i] || !in_b.is_visible[i]) continue;
    ++num_seen;
    EXPECT_LT((in_a.pixels[i] - in_b.pixels[i]).norm(), 1e-9);
  }
  EXPECT_GT(num_seen, 100);
}

TEST(ScaledCamera, IsSound) {
  const ImagePlane plane{{191.0, 190.5}, {254.9, 256.8}};
  const auto fisheye =
      std::make_shared<FisheyeCamera>(FisheyeModel(plane, {3.5e-3, 7e-4, -2e-3, 2e-4}), 512, 512);
  expect_camera_is_sound(ScaledCamera(fisheye, 0.5));
  expect_camera_is_sound(ScaledCamera(fisheye, 0.37));
}

TEST(ScaledCamera, IsTheCameraOfTheSmallerImage) {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({400.0, 402.0}, {319.5, 239.5}, kCoeffs), 640, 480);
  // Centre stays centre: pixel 319.5 of 640 columns is 127.5 of 256.
  const PerspectiveCamera smaller(
      PerspectiveModel({160.0, 160.8}, {127.5, 95.5}, kCoeffs), 256, 192);
  const ScaledCamera resized(camera, 0.4);
  EXPECT_EQ(resized.width_px(), 256);
  EXPECT_EQ(resized.height_px(), 192);
  expect_same_pixels(resized, smaller);
  const std::vector<Eigen::Vector3d> points = random_points_for_test(2000, 9);
  EXPECT_EQ(project_for_test(resized, points).is_visible,
            project_for_test(smaller, points).is_visible);
}

TEST(ScaledCamera, GoesRoundWithTheImage) {
  const auto sphere =
      std::make_shared<EquirectangularCamera>(EquirectangularModel(1280, 640), 1280, 640);
  EXPECT_EQ(ScaledCamera(sphere, 0.25).wrap_width_px(), 320.0);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/rotated_camera.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

ChainCamera camera_to_rotate(const std::string& model,
                             std::vector<double> intrinsics,
                             std::vector<double> coeffs = {}) {
  ChainCamera camera;
  camera.description.camera_model = model;
  camera.description.intrinsics = std::move(intrinsics);
  camera.description.distortion_coeffs = std::move(coeffs);
  if (!camera.description.distortion_coeffs.empty()) camera.description.distortion_model = "radtan";
  camera.description.width_px = 640;
  camera.description.height_px = model == "equirectangular" ? 320 : 400;
  return camera;
}

Eigen::Vector2d pixel_of(const ChainCamera& camera, const Eigen::Vector3d& point) {
  const auto made = CameraRegistry::with_builtin_models().make_camera(camera.description);
  Eigen::Vector2d pixel;
  std::uint8_t is_visible = 0;
  made->project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
  EXPECT_TRUE(is_visible);
  return pixel;
}

/// Where a pixel of an image goes that is turned.
Eigen::Vector2d turned(Eigen::Vector2d pixel, int num_quarters, double width, double height) {
  for (int i = 0; i < num_quarters; ++i) {
    pixel = {height - 1.0 - pixel.y(), pixel.x()};
    std::swap(width, height);
  }
  return pixel;
}

TEST(RotatedCamera, SeesTurnedWhatItSawBefore) {
  const Eigen::Vector3d point(0.3, -0.2, 1.1);
  const Rigid3 cam_from_rig(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.6, 0, 0.8))),
      Eigen::Vector3d(-0.11, 0.02, 0.01));
  for (ChainCamera camera :
       {camera_to_rotate("pinhole", {400.0, 410.0, 310.0, 190.0}),
        camera_to_rotate("pinhole", {400.0, 410.0, 310.0, 190.0}, {-0.2, 0.1, 0.01, -0.02, 0.03}),
        camera_to_rotate("eucm", {0.6, 1.05, 230.0, 231.0, 310.0, 190.0}),
        camera_to_rotate("ds", {-0.2, 0.6, 230.0, 231.0, 310.0, 190.0}),
        camera_to_rotate("equirectangular", {})}) {
    SCOPED_TRACE(camera.description.camera_model);
    camera.cam_from_rig = cam_from_rig;
    const Eigen::Vector2d before = pixel_of(camera, camera.cam_from_rig * point);
    for (int num_quarters = 1; num_quarters < 4; ++num_quarters) {
      const auto result = rotated(camera, num_quarters);
      if (camera.description.camera_model == "equirectangular" && num_quarters != 2) {
        EXPECT_FALSE(result);
        continue;
      }
      ASSERT_TRUE(result);
      const bool is_odd = num_quarters % 2 == 1;
      EXPECT_EQ(result->description.width_px, is_odd ? camera.description.height_px : 640);
      EXPECT_EQ(result->description.height_px, is_odd ? 640 : camera.description.height_px);
      // The rig is turned with its first camera.
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(0.5 * M_PI * num_quarters, Eigen::Vector3d::UnitZ()));
      const Eigen::Vector2d pixel = pixel_of(*result, result->cam_from_rig * (turn * point));
      const Eigen::Vector2d expected =
          turned(before, num_quarters, 640, camera.description.height_px);
      EXPECT_LT((pixel - expected).norm(), 1e-9) << pixel << "\n" << expected;
    }
  }
}

TEST(RotatedCamera, ReadsOutItsRowsFromTheOtherEnd) {
  ChainCamera camera = camera_to_rotate("pinhole", {400.0, 410.0, 310.0, 190.0});
  camera.readout_s = 0.02;
  EXPECT_EQ(rotated(camera, 2)->readout_s, -0.02);
  EXPECT_EQ(rotated(camera, 1)->readout_s, 0.0);
}

TEST(RotatedCamera, KnowsNothingOfModelsOfOthers) {
  EXPECT_FALSE(rotated(camera_to_rotate("mine", {1.0, 2.0, 3.0, 4.0}), 1));
}

}  // namespace
}  // namespace waymark

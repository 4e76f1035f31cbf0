// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/resized_camera.h"

#include <gtest/gtest.h>

#include "waymark/camera/registry.h"
#include "waymark/camera/scaled_camera.h"

namespace waymark {
namespace {

CameraDescription camera_of_640(const std::string& model, std::vector<double> intrinsics) {
  CameraDescription camera;
  camera.camera_model = model;
  camera.intrinsics = std::move(intrinsics);
  camera.width_px = 640;
  camera.height_px = 320;
  return camera;
}

TEST(ResizedCamera, SeesResizedWhatItSawBefore) {
  constexpr double kFactor = 0.3;
  const CameraRegistry registry = CameraRegistry::with_builtin_models();
  for (const CameraDescription& camera :
       {camera_of_640("pinhole", {400.0, 410.0, 310.0, 170.0}),
        camera_of_640("eucm", {0.6, 1.05, 230.0, 231.0, 310.0, 170.0}),
        camera_of_640("ds", {-0.2, 0.6, 230.0, 231.0, 310.0, 170.0}),
        camera_of_640("equirectangular", {})}) {
    SCOPED_TRACE(camera.camera_model);
    const auto expected = ScaledCamera(registry.make_camera(camera), kFactor);
    const auto small = resized(camera, kFactor);
    ASSERT_TRUE(small);
    const auto made = registry.make_camera(*small);
    EXPECT_EQ(made->width_px(), 192);
    EXPECT_EQ(made->height_px(), 96);
    for (const Eigen::Vector3d& point :
         {Eigen::Vector3d(0.3, -0.1, 1.0), Eigen::Vector3d(-0.5, 0.2, 1.0)}) {
      Eigen::Vector2d pixel, expected_pixel;
      std::uint8_t is_visible = 0;
      made->project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
      EXPECT_TRUE(is_visible);
      expected.project({&point, 1}, {&expected_pixel, 1}, {&is_visible, 1});
      EXPECT_LT((pixel - expected_pixel).norm(), 1e-9);
    }
  }
}

TEST(ResizedCamera, IsAsSureRelatively) {
  ChainCamera camera{camera_of_640("eucm", {0.6, 1.05, 230.0, 231.0, 310.0, 170.0}), Rigid3()};
  camera.sigmas.intrinsics = {0.01, 0.02, 1.0, 2.0, 3.0, 4.0};
  EXPECT_EQ(resized(camera, 0.5)->sigmas.intrinsics,
            (std::vector<double>{0.01, 0.02, 0.5, 1.0, 1.5, 2.0}));
}

TEST(ResizedCamera, KnowsNothingOfModelsOfOthers) {
  EXPECT_FALSE(has_image_plane(camera_of_640("mine", {1.0, 2.0, 3.0, 4.0})));
  EXPECT_FALSE(resized(camera_of_640("mine", {1.0, 2.0, 3.0, 4.0}), 0.5));
}

}  // namespace
}  // namespace waymark

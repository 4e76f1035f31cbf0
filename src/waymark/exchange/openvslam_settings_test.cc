// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/testing/errors.h"
#include "waymark/exchange/openvslam_camera.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

CameraChain read(const std::string& text) { return read_openvslam_settings({"config.yaml", text}); }

TEST(OpenvslamSettings, ReadsSections) {
  const CameraChain chain = read(R"(
Camera:
  name: "cam"
  setup: "monocular"
  model: "perspective"
  fx: 458.654
  fy: 457.296
  cx: 367.215
  cy: 248.375
  k1: -0.28340811
  k2: 0.07395907
  p1: 0.00019359
  p2: 1.76187114e-05
  k3: 0.0
  fps: 20.0
  cols: 752
  rows: 480
  color_order: "Gray"
Preprocessing:
  min_size: 250
Mapping:
  backend: "g2o"
)");
  ASSERT_EQ(chain.cameras.size(), 1u);
  const CameraDescription& camera = chain.cameras[0].description;
  EXPECT_EQ(camera.camera_model, "pinhole");
  EXPECT_EQ(camera.distortion_model, "radtan");
  EXPECT_THAT(camera.intrinsics, ElementsAre(458.654, 457.296, 367.215, 248.375));
  EXPECT_THAT(camera.distortion_coeffs,
              ElementsAre(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0));
  EXPECT_EQ(camera.width_px, 752);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_FALSE(chain.depth_factor);
  EXPECT_THAT(chain.notes, ElementsAre(HasSubstr("Preprocessing, Mapping")));
}

TEST(OpenvslamSettings, ReadsTheFlatKeysOfOldFiles) {
  const CameraChain chain = read(R"(%YAML:1.0
# Camera
Camera.name: "Kinect"
Camera.setup: "RGBD"
Camera.model: "fisheye"
Camera.fx: 500.0
Camera.fy: 501.0
Camera.cx: 320.5
Camera.cy: 241.5
Camera.k1: 0.01
Camera.k2: 0.002
Camera.k3: -0.001
Camera.k4: 0.0001
Camera.cols: 640
Camera.rows: 480
Feature.max_num_keypoints: 1000
Feature.mask_rectangles:
  - [0.0, 1.0, 0.0, 0.1]
depthmap_factor: 5000.0
)");
  const CameraDescription& camera = chain.cameras.at(0).description;
  EXPECT_EQ(camera.distortion_model, "equidistant");
  EXPECT_THAT(camera.distortion_coeffs, ElementsAre(0.01, 0.002, -0.001, 0.0001));
  EXPECT_EQ(chain.depth_factor, 5000.0);
  EXPECT_THAT(chain.notes, ElementsAre(HasSubstr(": Feature")));
}

TEST(OpenvslamSettings, KnowsTheOtherModels) {
  const CameraChain around =
      read("Camera: {setup: monocular, model: equirectangular, cols: 1920, rows: 960}");
  EXPECT_EQ(around.cameras.at(0).description.camera_model, "equirectangular");
  const CameraChain division = read(
      "Camera: {setup: monocular, model: radial_division, cols: 640, rows: 480, fx: 300, fy: 300,"
      " cx: 320, cy: 240, distortion: -0.1}");
  EXPECT_EQ(division.cameras.at(0).description.camera_model, "division");
}

constexpr const char* kStereo = R"(
Camera: {setup: stereo, model: perspective, cols: 640, rows: 480, fx: 350, fy: 350, cx: 320,
         cy: 240, focal_x_baseline: 42.0}
)";

TEST(OpenvslamSettings, ReadsRectifiedPairs) {
  const CameraChain chain = read(kStereo);
  ASSERT_EQ(chain.cameras.size(), 2u);
  EXPECT_NEAR(chain.cameras[1].cam_from_rig.translation.x(), -0.12, 1e-12);
  EXPECT_EQ(chain.cameras[1].description.intrinsics, chain.cameras[0].description.intrinsics);
}

/// What each camera sees, turned by its R, must lie in the same row, 42 / z columns apart.
TEST(OpenvslamSettings, UndoesRectification) {
  const double c = std::cos(0.02), s = std::sin(0.02);
  const CameraChain chain = read(fmt::format(R"({}
StereoRectifier:
  K_left: [400, 0, 310, 0, 401, 245, 0, 0, 1]
  K_right: [405, 0, 312, 0, 406, 241, 0, 0, 1]
  D_left: [-0.2, 0.05, 0.001, 0.0002, 0.0]
  D_right: [-0.21, 0.04, 0.0, 0.0003, 0.0]
  R_left: [{c}, 0, {s}, 0, 1, 0, {ms}, 0, {c}]
  R_right: [{c}, {ms}, 0, {s}, {c}, 0, 0, 0, 1]
)",
                                             kStereo,
                                             fmt::arg("c", c),
                                             fmt::arg("s", s),
                                             fmt::arg("ms", -s)));
  const Rig rig = make_rig(chain);
  EXPECT_EQ(chain.cameras[1].description.intrinsics[0], 405.0);
  Eigen::Matrix3d left, right;
  left << c, 0, s, 0, 1, 0, -s, 0, c;
  right << c, -s, 0, s, c, 0, 0, 0, 1;
  const Eigen::Vector3d point(0.5, -0.3, 4.0);  // In camera 0.
  const Eigen::Vector3d in_left = left * point;
  const Eigen::Vector3d in_right = right * (rig.cameras[1].cam_from_rig * point);
  EXPECT_NEAR(in_left.y() / in_left.z(), in_right.y() / in_right.z(), 1e-12);
  EXPECT_NEAR(
      350.0 * (in_left.x() / in_left.z() - in_right.x() / in_right.z()), 42.0 / in_left.z(), 1e-9);
}

TEST(OpenvslamSettings, NamesWhatIsWrong) {
  const auto error_of = [](const std::string& text) {
    return testing::input_error_of([&] { read(text); });
  };
  EXPECT_EQ(error_of("a: 1"), "config.yaml: has no Camera.model, which is needed");
  EXPECT_THAT(error_of("Camera: 3"), HasSubstr("has no Camera.model"));
  EXPECT_THAT(error_of("\nCamera: {model: square, setup: monocular, cols: 9, rows: 9, fx: 1, "
                       "fy: 1, cx: 1, cy: 1}"),
              HasSubstr("config.yaml:2: Camera: model 'square'"));
  EXPECT_THAT(error_of("Camera: {model: perspective, setup: monocular, cols: 640, rows: 480}"),
              HasSubstr("has no fx"));
  EXPECT_THAT(error_of("Camera: {model: perspective, setup: two, cols: 640, rows: 480, fx: 300, "
                       "fy: 300, cx: 320, cy: 240}"),
              HasSubstr("set-up 'two'"));
  EXPECT_THAT(error_of(std::string(kStereo) + "StereoRectifier: {K_left: [1, 2]}"),
              HasSubstr("R_left"));
}

}  // namespace
}  // namespace waymark

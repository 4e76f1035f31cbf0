// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/testing/errors.h"
#include "waymark/exchange/openvslam_camera.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;

CameraChain read_orbslam(const std::string& text) {
  return read_orbslam_settings({"s.yaml", text});
}

std::string newer(const std::string& type, const std::string& more) {
  return "%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"" + type +
         "\"\nCamera1.fx: 458.654\nCamera1.fy: 457.296\nCamera1.cx: 367.215\nCamera1.cy: 248.375\n"
         "Camera1.k1: -0.28340811\nCamera1.k2: 0.07395907\nCamera1.p1: 0.00019359\n"
         "Camera1.p2: 1.76187114e-05\nCamera.width: 752\nCamera.height: 480\nCamera.fps: 20\n"
         "ORBextractor.nFeatures: 1000\n" +
         more;
}

constexpr const char* kSecond =
    "Camera2.fx: 457.587\nCamera2.fy: 456.134\nCamera2.cx: 379.999\nCamera2.cy: 255.238\n"
    "Camera2.k1: -0.28368365\nStereo.ThDepth: 60.0\n"
    "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n"
    "  data: [1,0,0,0.11, 0,1,0,-0.0002, 0,0,1,0.0009, 0,0,0,1.0]\n";

TEST(OrbslamSettings, ReadsOneCamera) {
  const CameraChain chain = read_orbslam(newer("PinHole", ""));
  ASSERT_EQ(chain.cameras.size(), 1u);
  const CameraDescription& camera = chain.cameras[0].description;
  EXPECT_EQ(camera.camera_model, "pinhole");
  EXPECT_EQ(camera.distortion_model, "radtan");
  EXPECT_THAT(camera.intrinsics, ElementsAre(458.654, 457.296, 367.215, 248.375));
  EXPECT_THAT(camera.distortion_coeffs,
              ElementsAre(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0));
  EXPECT_EQ(camera.width_px, 752);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_THAT(chain.notes, ElementsAre(HasSubstr("ORBextractor")));
}

TEST(OrbslamSettings, ReadsPairs) {
  const CameraChain chain = read_orbslam(newer("PinHole", kSecond));
  ASSERT_EQ(chain.cameras.size(), 2u);
  // Camera 2 is 11 cm to the right of camera 1.
  EXPECT_TRUE(chain.cameras[1].cam_from_rig.translation.isApprox(
      Eigen::Vector3d(-0.11, 0.0002, -0.0009), 1e-12));
  EXPECT_EQ(chain.cameras[1].description.intrinsics[0], 457.587);

  const CameraChain rectified = read_orbslam(newer("Rectified", "Stereo.b: 0.11\n"));
  ASSERT_EQ(rectified.cameras.size(), 2u);
  EXPECT_EQ(rectified.cameras[1].cam_from_rig.translation.x(), -0.11);
  EXPECT_EQ(rectified.cameras[0].description.distortion_model, "none");
}

TEST(OrbslamSettings, ReadsFisheyesAndDepth) {
  const CameraChain fisheye = read_orbslam(newer("KannalaBrandt8", "Camera1.k3: 0.001\n"));
  EXPECT_EQ(fisheye.cameras[0].description.distortion_model, "equidistant");
  EXPECT_THAT(fisheye.cameras[0].description.distortion_coeffs,
              ElementsAre(-0.28340811, 0.07395907, 0.001, 0.0));
  const CameraChain depth =
      read_orbslam(newer("PinHole", "Stereo.b: 0.07732\nRGBD.DepthMapFactor: 5000.0\n"));
  EXPECT_EQ(depth.cameras.size(), 1u);
  EXPECT_EQ(depth.depth_factor, 5000.0);
}

TEST(OrbslamSettings, ReadsTheFlatKeysOfOlderFiles) {
  const std::string one =
      "Camera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.4\nCamera.cy: 252.2\nCamera.k1: 0.0\n"
      "Camera.width: 752\nCamera.height: 480\n";
  EXPECT_EQ(read_orbslam(one).cameras.size(), 1u);
  EXPECT_EQ(read_orbslam(one + "Camera.bf: 40\nDepthMapFactor: 5000\n").depth_factor, 5000.0);
  const CameraChain pair = read_orbslam(one + "Camera.bf: 43.52\n");
  ASSERT_EQ(pair.cameras.size(), 2u);
  EXPECT_NEAR(pair.cameras[1].cam_from_rig.translation.x(), -0.1, 1e-12);

  // The right camera is turned by 0.1 rad about y before rectification.
  std::string rectifier;
  for (const char* side : {"LEFT", "RIGHT"}) {
    const bool is_left = side == std::string("LEFT");
    const auto matrix = [&](const char* key, int cols, const std::string& data) {
      rectifier += std::string(side) + "." + key +
                   ": !!opencv-matrix\n  rows: " + (cols == 3 ? "3" : "1") +
                   "\n  cols: " + std::to_string(cols) + "\n  dt: d\n  data: [" + data + "]\n";
    };
    rectifier += std::string(side) + ".width: 752\n" + side + ".height: 480\n";
    matrix("K", 3, "458.6, 0, 367.2, 0, 457.3, 248.4, 0, 0, 1");
    matrix("D", 5, "-0.28, 0.07, 0.0002, 0, 0");
    matrix("R",
           3,
           is_left ? "1, 0, 0, 0, 1, 0, 0, 0, 1"
                   : "0.9950041653, 0, 0.0998334166, 0, 1, 0, -0.0998334166, 0, 0.9950041653");
  }
  const CameraChain raw = read_orbslam(one + "Camera.bf: 43.52\n" + rectifier);
  EXPECT_EQ(raw.cameras[0].description.distortion_model, "radtan");
  EXPECT_NEAR(Eigen::AngleAxisd(raw.cameras[1].cam_from_rig.rotation).angle(), 0.1, 1e-6);
  // Its centre stays 10 cm to the right of the other.
  EXPECT_TRUE(
      raw.cameras[1].cam_from_rig.inverse().translation.isApprox(Eigen::Vector3d(0.1, 0, 0), 1e-9));
}

TEST(OrbslamSettings, NamesWhatIsWrong) {
  EXPECT_THAT(input_error_of([] { read_orbslam(newer("Omni", "")); }),
              HasSubstr("s.yaml:4: Camera.type is Omni, expected PinHole"));
  EXPECT_THAT(input_error_of([] { read_orbslam("Camera.fx: 400\n"); }),
              HasSubstr("s.yaml: has no Camera.width, which is needed"));
  EXPECT_THAT(input_error_of([] { read_orbslam(newer("Rectified", "Stereo.b: -1\n")); }),
              HasSubstr("baseline of -1 m"));
  EXPECT_THAT(input_error_of([] {
                read_orbslam(newer("PinHole", "Camera2.fx: 1\nStereo.T_c1_c2: [1, 2]\n"));
              }),
              HasSubstr("has 2 numbers, expected 16"));
}

}  // namespace
}  // namespace waymark

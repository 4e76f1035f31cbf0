// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/foreign_calibration.h"

#include <gmock/gmock.h>

#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// As OpenCV's calibration sample writes it.
constexpr const char* kOpenCv = R"(%YAML:1.0
---
calibration_time: "Mon 02 Mar 2020 10:00:00"
nframes: 20
image_width: 640
image_height: 480
board_width: 9
square_size: 2.5000000372529030e-02
flags: 0
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259109564815858e-01
)";

constexpr const char* kRos = R"(image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
)";

// As ros2 topic echo prints it.
constexpr const char* kRosMessage =
    "header: {stamp: {sec: 1, nanosec: 2}, frame_id: cam}\n"
    "height: 512\nwidth: 512\ndistortion_model: equidistant\n"
    "d: [0.0034, 0.0007, -0.0020, 0.0002]\n"
    "k: [190.9, 0, 254.9, 0, 190.9, 256.8, 0, 0, 1]\n";

constexpr const char* kColmap =
    "# Camera list with one line of data per camera:\n"
    "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "# Number of cameras: 2\n"
    "1 OPENCV 3072 2304 2559.81 2560.25 1536.5 1152.5 -0.03 0.01 0.001 -0.002\n"
    "2 PINHOLE 3072 2304 2560.56 2560.56 1536 1152\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

CameraDescription opencv(const std::string& text) {
  return read_opencv_calibration({"a.yml", text}).cameras.at(0).description;
}
CameraDescription ros(const std::string& text) {
  return read_ros_calibration({"a.yaml", text}).cameras.at(0).description;
}
CameraDescription colmap(const std::string& text) {
  return read_colmap_calibration({"cameras.txt", text}).cameras.at(0).description;
}

TEST(ForeignCalibration, ReadsOpenCv) {
  const CameraDescription camera = opencv(kOpenCv);
  EXPECT_EQ(camera.camera_model, "pinhole");
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_THAT(
      camera.intrinsics,
      ElementsAre(535.91573396163199, 535.91573396163199, 342.28315473308373, 235.57082909788173));
  EXPECT_EQ(camera.distortion_model, "radtan");
  ASSERT_EQ(camera.distortion_coeffs.size(), 5u);
  EXPECT_EQ(camera.distortion_coeffs[4], 0.23839153080878486);
}

TEST(ForeignCalibration, ReadsOpenCvFisheye) {
  std::string text = replaced(kOpenCv, "fisheye_model: 0", "fisheye_model: 1");
  EXPECT_THAT(input_error_of([&] { opencv(text); }),
              HasSubstr("distortion_coeffs has 5 numbers, expected 4 for equidistant"));
  text = replaced(text, ",\n       2.3839153080878486e-01", "");
  text = replaced(text, "-2.6637260909660682e-01", "-2.6637260909660682e-03");
  EXPECT_EQ(opencv(text).distortion_model, "equidistant");
}

TEST(ForeignCalibration, OpenCvTermsOfZeroAreLeftOut) {
  const std::string longer =
      replaced(kOpenCv, "2.3839153080878486e-01", "0.2, 0, 0, 0, 0, 0, 0, 0, 0, 0");
  EXPECT_EQ(opencv(longer).distortion_coeffs.size(), 8u);
  const std::string tilted = replaced(longer, "0, 0 ]", "0, 0.1 ]");
  EXPECT_THAT(input_error_of([&] { opencv(tilted); }), HasSubstr("thin prism or tilt"));
}

TEST(ForeignCalibration, ReadsRos) {
  const CameraDescription camera = ros(kRos);
  EXPECT_THAT(camera.intrinsics, ElementsAre(438.783367, 437.302876, 305.593336, 243.738352));
  EXPECT_THAT(camera.distortion_coeffs, ElementsAre(-0.361976, 0.110510, 0.001014, 0.000505, 0.0));
  const CameraDescription message = ros(kRosMessage);
  EXPECT_EQ(message.distortion_model, "equidistant");
  EXPECT_EQ(message.width_px, 512);
  EXPECT_THAT(message.distortion_coeffs, ElementsAre(0.0034, 0.0007, -0.0020, 0.0002));
}

TEST(ForeignCalibration, ReadsColmapFromTheCornerOfThePixel) {
  const CameraDescription camera = colmap(kColmap);
  EXPECT_THAT(camera.intrinsics, ElementsAre(2559.81, 2560.25, 1536.0, 1152.0));
  EXPECT_THAT(camera.distortion_coeffs, ElementsAre(-0.03, 0.01, 0.001, -0.002));
  EXPECT_THAT(read_colmap_calibration({"cameras.txt", kColmap}).notes,
              ElementsAre("cameras.txt: the first of 2 cameras is taken"));
  const CameraDescription simple = colmap("7 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n");
  EXPECT_THAT(simple.intrinsics, ElementsAre(500.0, 500.0, 319.5, 239.5));
  EXPECT_THAT(simple.distortion_coeffs, ElementsAre(-0.1, 0.0, 0.0, 0.0));
  const CameraDescription fisheye = colmap("7 RADIAL_FISHEYE 640 480 250 320 240 -0.01 0.001\n");
  EXPECT_EQ(fisheye.distortion_model, "equidistant");
  EXPECT_THAT(colmap("1 PINHOLE 640 480 500 500 320 240").distortion_coeffs, IsEmpty());
}

TEST(ForeignCalibration, FaultsAreNamed) {
  const auto opencv_error = [](const std::string& from, const std::string& to) {
    return input_error_of([&] { opencv(replaced(kOpenCv, from, to)); });
  };
  EXPECT_EQ(opencv_error("image_width: 640", ""), "a.yml: has no image_width, which is needed");
  EXPECT_THAT(opencv_error("640", "-640"), HasSubstr("image_width is -640, expected an integer"));
  EXPECT_EQ(opencv_error("camera_matrix", "camera"),
            "a.yml: has no camera_matrix, which is needed");
  EXPECT_THAT(opencv_error("5.3591573396163199e+02", "0"), HasSubstr("focal length fu is 0"));
  EXPECT_THAT(opencv_error("0., 3.42", "7., 3.42"), HasSubstr("expected one without skew"));
  EXPECT_THAT(opencv_error("0., 0., 1. ]", "0., 0. ]"), HasSubstr("has 8 numbers, expected 3x3"));
  EXPECT_THAT(opencv_error("5.3591573396163199e+02", ".nan"), HasSubstr("a.yml:"));
  const auto ros_error = [](const std::string& from, const std::string& to) {
    return input_error_of([&] { ros(replaced(kRos, from, to)); });
  };
  EXPECT_THAT(ros_error("plumb_bob", "thin_prism"),
              HasSubstr("a.yaml:8: distortion_model is 'thin_prism', expected plumb_bob"));
  EXPECT_THAT(ros_error("distortion_model: plumb_bob", ""), HasSubstr("has no distortion_model"));
  const auto colmap_error = [](const std::string& text) {
    return input_error_of([&] { colmap(text); });
  };
  EXPECT_THAT(colmap_error("# nothing\n"), StartsWith("cameras.txt: holds no camera"));
  EXPECT_THAT(colmap_error("1 FOV 640 480 500 500 320 240 0.9\n"),
              StartsWith("cameras.txt:1: model is 'FOV', expected one of: SIMPLE_PINHOLE"));
  EXPECT_THAT(colmap_error("1 PINHOLE 640 480 500 320 240\n"),
              HasSubstr("PINHOLE has 3 parameters, expected 4"));
  EXPECT_THAT(colmap_error("1 PINHOLE 640.5 480 500 500 320 240\n"), HasSubstr("expected an int"));
  EXPECT_THAT(colmap_error("1 PINHOLE 640 480 500 x 320 240\n"), StartsWith("cameras.txt:1: "));
  EXPECT_THAT(colmap_error("1 PINHOLE\n"), StartsWith("cameras.txt:1: "));
}

TEST(ForeignCalibration, HostileFilesEndInOneLine) {
  Rng rng(5, 0);
  for (const char* text : {kOpenCv, kRos, kRosMessage, kColmap}) {
    for (int round = 0; round < 400; ++round) {
      std::string broken = text;
      for (int k = 0; k < 1 + round % 4; ++k) {
        const auto at =
            static_cast<std::size_t>(rng.uniform(0.0, static_cast<double>(broken.size())));
        switch (round % 3) {
          case 0:
            broken[at] = static_cast<char>(rng.uniform(-128.0, 128.0));
            break;
          case 1:
            broken.erase(at, static_cast<std::size_t>(rng.uniform(0.0, 40.0)));
            break;
          default:
            broken.insert(at, broken.substr(at / 2, 30));
        }
        if (broken.empty()) broken.push_back(' ');
      }
      for (const std::string& message : {input_error_of([&] { opencv(broken); }),
                                         input_error_of([&] { ros(broken); }),
                                         input_error_of([&] { colmap(broken); })}) {
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      }
    }
  }
}

}  // namespace
}  // namespace waymark

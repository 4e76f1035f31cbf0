// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Calibrations of other programs, recognised by what they hold.
#include <gmock/gmock.h>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;

constexpr const char* kBasalt = R"({"value0": {
  "T_imu_cam": [
    {"px": 0.0, "py": 0.1, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0},
    {"px": 0.11, "py": 0.1, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0}],
  "intrinsics": [
    {"camera_type": "kb4", "intrinsics": {"fx": 190.9, "fy": 190.8, "cx": 254.9, "cy": 256.8,
     "k1": 0.0034, "k2": 0.0007, "k3": -0.002, "k4": 0.0002}},
    {"camera_type": "ds", "intrinsics": {"fx": 160, "fy": 161, "cx": 254, "cy": 256, "xi": -0.2,
     "alpha": 0.6}}],
  "resolution": [[512, 511], [512, 512]]}})";
constexpr const char* kFisheyeOfVins =
    "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\nimage_width: 848\nimage_height: 800\n"
    "projection_parameters:\n   k2: -0.006\n   k3: 0.043\n   k4: -0.041\n   k5: 0.007\n"
    "   mu: 285.1\n   mv: 285.0\n   u0: 424.1\n   v0: 396.0\n";
constexpr const char* kMei =
    "model_type: MEI\nimage_width: 752\nimage_height: 480\nmirror_parameters:\n   xi: 3.6\n"
    "distortion_parameters: {k1: -0.06, k2: 0.7, p1: 0.0003, p2: 0.0001}\n"
    "projection_parameters: {gamma1: 2130, gamma2: 2120, u0: 360, v0: 240}\n";
constexpr const char* kBrown =
    R"({"v2 dji 5472 3648 brown 0.6666": {"projection_type": "brown", "width": 5472, "height": 3648,
        "focal_x": 0.67, "focal_y": 0.66, "c_x": 0.001, "c_y": -0.002, "k1": -0.01, "k2": 0.02,
        "p1": 0.0003, "p2": 0.0004, "k3": 0.005}, "other": {"projection_type": "spherical"}})";
constexpr const char* kOpenIcc =
    R"({"image_height": 2028, "image_width": 2704, "intrinsic_type": "FISHEYE", "intrinsics": {
        "aspect_ratio": 1.003, "focal_length": 800, "principal_pt_x": 1349.5,
        "principal_pt_y": 1010.25, "radial_distortion_1": -0.02, "radial_distortion_2": -0.01,
        "radial_distortion_3": 0.001, "radial_distortion_4": -0.0001, "skew": 0.0}})";
constexpr const char* kMetashape =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- by hand -->\n<calibration>\n"
    "  <projection>frame</projection><width>640</width><height>480</height><f>420</f><cx>-3</cx>"
    "<cy>2</cy><k1>-0.2</k1><k2>0.05</k2><p1>0.001</p1><p2>0.002</p2><b1>1</b1></calibration>\n";
constexpr const char* kXmlOfOpencv =
    "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_Width>640</image_Width>\n"
    "<image_Height>480</image_Height>\n<Camera_Matrix type_id=\"opencv-matrix\"><rows>3</rows>"
    "<data>\n420. 0. 317. 0. 421. 242. 0. 0. 1.</data></Camera_Matrix>\n<Distortion_Coefficients>"
    "<data>-0.2 0.05 0.0002 -0.0001 0.</data></Distortion_Coefficients>\n</opencv_storage>\n";
constexpr const char* kPairOfOpencv =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
    "K1: [420, 0, 317, 0, 421, 242, 0, 0, 1]\nD1: [-0.2, 0.05, 0, 0, 0]\n"
    "K2: [430, 0, 317, 0, 431, 242, 0, 0, 1]\nD2: [-0.1, 0.05, 0, 0, 0]\n"
    "R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [-0.11, 0, 0]\n";
constexpr const char* kEchoedMessage =
    "height: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
    "d:\n- -0.19\n- 0.048\n- 0.0002\n- -0.0001\n- 0.0\n- 0.0\n- 0.0\n- 0.0\n"
    "k: [420, 0, 317, 0, 421, 242, 0, 0, 1]\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
    "p: [420, 0, 317, 0, 0, 421, 242, 0, 0, 0, 1, 0]\n---\n";

CameraChain chain_of(const std::string& text) {
  return read_foreign_calibration({"a", text}).value();
}
CameraDescription camera_of(const std::string& text) {
  return chain_of(text).cameras.at(0).description;
}
std::string fault_of(const std::string& text) {
  return input_error_of([&] { read_foreign_calibration({"a", text}); });
}
std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(NamedCalibration, OfBasaltMayBeOfAPair) {
  const CameraChain chain = chain_of(kBasalt);
  const CameraDescription& camera = chain.cameras.at(0).description;
  EXPECT_THAT(camera.intrinsics, ElementsAre(190.9, 190.8, 254.9, 256.8));
  EXPECT_EQ(camera.distortion_model, "equidistant");
  EXPECT_THAT(camera.distortion_coeffs, ElementsAre(0.0034, 0.0007, -0.002, 0.0002));
  EXPECT_EQ(camera.height_px, 511);
  const ChainCamera& right = chain.cameras.at(1);
  EXPECT_EQ(right.description.camera_model, "ds");
  EXPECT_THAT(right.description.intrinsics, ElementsAre(-0.2, 0.6, 160, 161, 254, 256));
  EXPECT_TRUE(right.cam_from_rig.translation.isApprox(Eigen::Vector3d(-0.11, 0.0, 0.0)));
}

TEST(NamedCalibration, OfVins) {
  const CameraDescription fisheye = camera_of(kFisheyeOfVins);
  EXPECT_THAT(fisheye.intrinsics, ElementsAre(285.1, 285.0, 424.1, 396.0));
  EXPECT_THAT(fisheye.distortion_coeffs, ElementsAre(-0.006, 0.043, -0.041, 0.007));
  const CameraDescription mei = camera_of(kMei);
  EXPECT_EQ(mei.camera_model, "omni");
  EXPECT_THAT(mei.intrinsics, ElementsAre(3.6, 2130, 2120, 360, 240));
  EXPECT_THAT(mei.distortion_coeffs, ElementsAre(-0.06, 0.7, 0.0003, 0.0001));
}

TEST(NamedCalibration, OfPhotogrammetry) {
  const CameraDescription brown = camera_of(kBrown);
  EXPECT_NEAR(brown.intrinsics.at(0), 3666.24, 1e-9);
  EXPECT_NEAR(brown.intrinsics.at(1), 3611.52, 1e-9);
  EXPECT_NEAR(brown.intrinsics.at(2), 2735.5 + 5.472, 1e-9);
  EXPECT_NEAR(brown.intrinsics.at(3), 1823.5 - 10.944, 1e-9);
  EXPECT_THAT(brown.distortion_coeffs, ElementsAre(-0.01, 0.02, 0.0003, 0.0004, 0.005));
  EXPECT_THAT(chain_of(kBrown).notes, ElementsAre("a: the first of 2 cameras is taken"));
  const CameraDescription metashape = camera_of(kMetashape);
  EXPECT_THAT(metashape.intrinsics, ElementsAre(421, 420, 316.5, 241.5));
  EXPECT_THAT(metashape.distortion_coeffs, ElementsAre(-0.2, 0.05, 0.002, 0.001, 0));
  const CameraDescription openicc = camera_of(kOpenIcc);
  EXPECT_THAT(openicc.intrinsics, ElementsAre(800, 1.003 * 800, 1349.5, 1010.25));
  EXPECT_EQ(openicc.distortion_model, "equidistant");
}

TEST(OpencvCalibration, AsXmlAndOfPairs) {
  const CameraDescription xml = camera_of(kXmlOfOpencv);
  EXPECT_THAT(xml.intrinsics, ElementsAre(420, 421, 317, 242));
  EXPECT_THAT(xml.distortion_coeffs, ElementsAre(-0.2, 0.05, 0.0002, -0.0001, 0));
  const CameraChain pair = chain_of(kPairOfOpencv);
  EXPECT_EQ(pair.cameras.at(1).description.intrinsics[0], 430);
  EXPECT_TRUE(pair.cameras[1].cam_from_rig.translation.isApprox(Eigen::Vector3d(-0.11, 0, 0)));
  EXPECT_EQ(fault_of(with(kPairOfOpencv, "image_width: 640\n", "")),
            "a: is a stereo calibration of OpenCV without the size of its images, expected "
            "image_width and image_height in it");
}

TEST(RosCalibration, MayBeSeveralMessagesOfOneCamera) {
  const std::string message = kEchoedMessage;
  for (const std::string& text : {message, message + message, "---\n" + message}) {
    const CameraDescription camera = camera_of(text);
    EXPECT_THAT(camera.intrinsics, ElementsAre(420, 421, 317, 242));
    EXPECT_THAT(camera.distortion_coeffs, ElementsAre(-0.19, 0.048, 0.0002, -0.0001, 0));
  }
  EXPECT_EQ(fault_of(message + message + with(message, "[420", "[430")),
            "a: message 3 has other numbers than the first, expected messages of one camera");
  EXPECT_THAT(fault_of(message + with(message, "[420", "[x")), HasSubstr("a (message 2):1"));
}

TEST(RosCalibration, OfTwoCamerasIsThatOfTheirPair) {
  const std::string left = kEchoedMessage;
  const std::string right = with(left, "p: [420, 0, 317, 0,", "p: [420, 0, 317, -50.4,");
  const CameraChain chain = read_ros_pair({"left", left}, {"right", right});
  EXPECT_TRUE(chain.cameras.at(1).cam_from_rig.translation.isApprox(Eigen::Vector3d(-0.12, 0, 0)));
  EXPECT_EQ(input_error_of([&] {
              read_ros_pair({"left", left}, {"right", left});
            }),
            "right: has no baseline to left in its projection_matrix, expected the two files of a "
            "stereo calibration, or one file");
}

TEST(ForeignCalibration, ThatIsNotReadIsNamed) {
  EXPECT_THAT(fault_of("[LEFT_CAM_VGA]\nfx=349.891\n[RIGHT_CAM_VGA]\nfx=1\n"),
              HasSubstr("a: looks like the factory calibration of a ZED, which is not read"));
  EXPECT_THAT(fault_of("0.53 0.66 0.49 0.5 0.89\n1280 1024\ncrop\n640 480\n"),
              HasSubstr("a: looks like camera.txt of DSO, which is not read"));
  EXPECT_THAT(fault_of("<html><body>404</body></html>"),
              HasSubstr("a: is XML of 'html', expected"));
  EXPECT_THAT(fault_of("<calibration><f>1</f>"), HasSubstr("a:1: ends within an element"));
  EXPECT_THAT(
      fault_of(with(kMei, "MEI", "SCARAMUZZA")),
      HasSubstr("a:1: model_type is 'SCARAMUZZA', expected one of: PINHOLE, KANNALA_BRANDT"));
  EXPECT_THAT(fault_of(with(kOpenIcc, "1.003", "1.0.3")),
              HasSubstr("aspect_ratio is 1.0.3, expected a number"));
  EXPECT_THAT(fault_of(with(kOpenIcc, "\"skew\": 0.0", "\"skew\": 0.1")), HasSubstr("has skew"));
  EXPECT_THAT(fault_of(with(kMetashape, "<b1>", "<b2>2</b2><b1>")),
              HasSubstr("has b2, which has no counterpart"));
  EXPECT_THAT(fault_of(with(kBasalt, "\"qw\": 1.0", "\"qw\": 0.5")), HasSubstr("unit quaternion"));
  EXPECT_FALSE(read_foreign_calibration({"a", "features: {count: 700}\n"}));
}

TEST(ForeignCalibration, ThatIsDamagedIsOneLine) {
  Rng rng(11, 0);
  for (const std::string whole : {kBasalt,
                                  kFisheyeOfVins,
                                  kMei,
                                  kBrown,
                                  kOpenIcc,
                                  kMetashape,
                                  kXmlOfOpencv,
                                  kPairOfOpencv,
                                  kEchoedMessage}) {
    for (int i = 0; i < 300; ++i) {
      std::string text = whole;
      if (i % 3 == 0) text.resize(1 + rng.below(static_cast<std::uint32_t>(whole.size())));
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
      try {
        read_foreign_calibration({"a", text});
      } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace waymark

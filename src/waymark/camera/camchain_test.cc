// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/camchain.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// What Kalibr writes for the stereo camera of the EuRoC data set.
constexpr const char* kKalibrStereo = R"(cam0:
  T_cam_imu:
  - [0.01, -0.99, 0.01, 0.0]
  - [0.99, 0.01, 0.02, 0.0]
  - [-0.02, 0.02, 0.99, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.001
cam1:
  T_cn_cnm1:
  - [0.9999972564774497, 0.0023120671924201593, 0.00037600810235099286, -0.11007380812713924]
  - [-0.0023171357232846185, 0.9998980485065276, 0.01408983584669731, 0.00039912154701445685]
  - [-0.000343393120588828, -0.014090668452670353, 0.9999006626381794, -0.0008537025033513194]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.28368365, 0.07451284, -0.00010473, -3.555907e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
)";

constexpr const char* kPlain =
    "camera_model: pinhole, intrinsics: [500, 500, 320, 240], "
    "resolution: [640, 480]";

std::optional<CameraChain> read(const std::string& text) {
  return read_camchain(parse_config({"a.yaml", text}));
}

std::string error_of(const std::string& text) {
  try {
    const std::optional<CameraChain> chain = read(text);
    if (chain) make_rig(*chain);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string one_camera(const std::string& more) {
  return std::string("cam0: {") + kPlain + more + "}\n";
}

TEST(Camchain, ReadsWhatKalibrWrites) {
  const std::optional<CameraChain> chain = read(kKalibrStereo);
  ASSERT_TRUE(chain);
  ASSERT_EQ(chain->cameras.size(), 2u);
  EXPECT_EQ(chain->cameras[0].description.intrinsics[2], 367.215);
  EXPECT_EQ(chain->cameras[1].description.distortion_coeffs.size(), 4u);
  EXPECT_EQ(chain->cameras[1].description.where, "a.yaml:15: cam1");
  EXPECT_FALSE(chain->depth_factor);
  ASSERT_EQ(chain->notes.size(), 4u);
  EXPECT_EQ(chain->notes[0], "a.yaml:7: cam0.cam_overlaps is ignored");
  const Rig rig = make_rig(*chain);
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[0].cam_from_rig.translation, Eigen::Vector3d::Zero());
  const Rigid3& right_from_left = rig.cameras[1].cam_from_rig;
  EXPECT_NEAR(right_from_left.translation.x(), -0.11007380812713924, 1e-15);
  EXPECT_NEAR(right_from_left.rotation_matrix()(1, 2), 0.01408983584669731, 1e-7);
  EXPECT_NEAR(right_from_left.rotation_matrix()(2, 1), -0.014090668452670353, 1e-7);
  EXPECT_EQ(rig.cameras[1].camera->width_px(), 752);
}

TEST(Camchain, ReadsFisheyePairsAndWholeSpheres) {
  const std::string fisheye =
      "{camera_model: pinhole, intrinsics: [190.978, 190.973, 254.93, 256.897], "
      "distortion_model: equidistant, "
      "distortion_coeffs: [0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673], "
      "resolution: [512, 512]";
  const auto pair = read("cam0: " + fisheye + "}\ncam1: " + fisheye +
                         ", T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], "
                         "[0, 0, 0, 1]]}\n");
  const Rig rig = make_rig(pair.value());
  EXPECT_EQ(rig.cameras[1].camera->model(), "fisheye");
  const auto sphere = read("cam0: {camera_model: equirectangular, resolution: [1280, 640]}\n");
  EXPECT_EQ(make_rig(sphere.value()).cameras[0].camera->wrap_width_px(), 1280.0);
  EXPECT_THAT(
      error_of("cam0: " + fisheye.substr(0, fisheye.find("equidistant")) +
               "equidistant, resolution: [512, 512]}\n"),
      EndsWith("cam0: distortion_coeffs has 0 numbers, expected 4 for equidistant: k1 k2 k3 "
               "k4"));
}

TEST(Camchain, TransformationsChain) {
  const std::string step =
      ", T_cn_cnm1: [[0, -1, 0, 0.5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]";
  const auto chain =
      read(one_camera("") + "cam1: {" + kPlain + step + "}\ncam2: {" + kPlain + step + "}\n");
  ASSERT_TRUE(chain);
  ASSERT_EQ(chain->cameras.size(), 3u);
  EXPECT_THAT(chain->notes,
              ElementsAre("a.yaml:3: cam2 is ignored, cam0 and cam1 at most are used"));
  // Two quarter turns about z, each followed by half a metre along x.
  const Eigen::Vector3d point = chain->cameras[2].cam_from_rig * Eigen::Vector3d(1.0, 2.0, 3.0);
  EXPECT_LT((point - Eigen::Vector3d(-0.5, -1.5, 3.0)).norm(), 1e-12);
}

TEST(Camchain, ReadsBackWhatItWrites) {
  CameraChain chain = read(kKalibrStereo).value();
  EXPECT_THAT(format_camchain(chain), Not(HasSubstr("sigma")));
  chain.depth_factor = 5000.0;
  chain.cameras[0].sigmas.intrinsics = {0.5, 0.25, 0.0, 3.0};
  chain.cameras[1].sigmas.distortion_coeffs = {0.01, 0.02, 1.5e-4, 0.0};
  chain.cameras[1].sigmas.rotation_rad = {1e-4, 2e-4, 0.0};
  chain.cameras[1].sigmas.baseline_direction_rad = {3e-4, 5e-4};
  const CameraChain again = read(format_camchain(chain)).value();
  for (std::size_t i = 0; i < 2; ++i) {
    const ChainCamera& camera = again.cameras[i];
    EXPECT_TRUE(camera.description.is_same(chain.cameras[i].description));
    EXPECT_LT((camera.cam_from_rig.matrix() - chain.cameras[i].cam_from_rig.matrix()).norm(), 1e-9);
  }
  EXPECT_EQ(again.depth_factor, 5000.0);
  const Rig rig = make_rig(again);
  EXPECT_THAT(rig.cameras[0].sigmas.intrinsics, ElementsAre(0.5, 0.25, 0.0, 3.0));
  EXPECT_THAT(rig.cameras[0].sigmas.distortion_coeffs, IsEmpty());
  const CalibrationSigmas& sigmas = rig.cameras[1].sigmas;
  EXPECT_THAT(sigmas.distortion_coeffs, ElementsAre(0.01, 0.02, 1.5e-4, 0.0));
  EXPECT_THAT(sigmas.rotation_rad, ElementsAre(DoubleEq(1e-4), DoubleEq(2e-4), 0.0));
  EXPECT_THAT(sigmas.baseline_direction_rad, ElementsAre(DoubleEq(3e-4), DoubleEq(5e-4)));
}

TEST(Camchain, StandardDeviationsAreChecked) {
  EXPECT_EQ(error_of(one_camera(", intrinsics_sigma: [1, 1, 1]")),
            "a.yaml:1: cam0.intrinsics_sigma has 3 numbers, expected 4, a standard deviation for "
            "each");
  EXPECT_THAT(error_of(one_camera(", intrinsics_sigma: [1, -1, 1, 1]")),
              EndsWith("cam0.intrinsics_sigma[1] is -1, expected a number from 0 to 100000"));
  EXPECT_THAT(error_of(one_camera(", intrinsics_sigma: [1, .inf, 1, 1]")),
              HasSubstr("intrinsics_sigma[1] is .inf, expected a number"));
  EXPECT_THAT(error_of(one_camera(", distortion_coeffs_sigma: [0.1]")),
              HasSubstr("has 1 numbers, expected 0"));
  const auto turn_error = [](const std::string& sigma) {
    return error_of(one_camera("") + "cam1: {" + kPlain +
                    ", T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "
                    "T_cn_cnm1_sigma: " +
                    sigma + "}\n");
  };
  EXPECT_EQ(turn_error("{rotation_mrad: [1, 1, 0]}"), "no error");
  EXPECT_THAT(turn_error("0.5"), EndsWith("is 0.5, expected a section of KEY: VALUE"));
  EXPECT_THAT(turn_error("{rotation_mrad: [1]}"), HasSubstr("has 1 numbers, expected 3"));
  EXPECT_THAT(turn_error("{rotation: [1, 1, 1]}"),
              EndsWith("expected one of rotation_mrad, baseline_direction_mrad"));
  EXPECT_THAT(error_of(one_camera(", T_cn_cnm1_sigma: {rotation_mrad: [1, 1, 1]}")),
              HasSubstr("cam0.T_cn_cnm1_sigma is given, expected none"));
}

TEST(Camchain, DepthFactor) {
  EXPECT_EQ(read(one_camera("") + "depth: {factor: 5000}\n")->depth_factor, 5000.0);
  EXPECT_EQ(read(one_camera("") + "depth:\n")->depth_factor, std::nullopt);
  EXPECT_EQ(error_of(one_camera("") + "depth: {factor: -1}\n"),
            "a.yaml:2: depth.factor is -1, expected a number from 0.001 to 1000000000");
}

TEST(Camchain, ReadoutOfARollingShutter) {
  EXPECT_EQ(make_rig(*read(one_camera(""))).cameras[0].readout_s, 0.0);
  EXPECT_DOUBLE_EQ(make_rig(*read(one_camera(", readout_ms: 22.5"))).cameras[0].readout_s, 0.0225);
  EXPECT_DOUBLE_EQ(make_rig(*read(one_camera(", readout_ms: -30"))).cameras[0].readout_s, -0.03)
      << "from the bottom up";
  EXPECT_EQ(error_of(one_camera(", readout_ms: 33000")),
            "a.yaml:1: cam0.readout_ms is 33000, expected a number from -1000 to 1000");
}

TEST(Camchain, SettingsAloneHaveNoCameras) {
  EXPECT_FALSE(read("features: {count: 1000}\n"));
  EXPECT_FALSE(read(""));
}

TEST(Camchain, FaultsNameTheLine) {
  EXPECT_EQ(error_of("cam0:\n  camera_model: pinhole\n  intrinsic: [1, 2, 3, 4]\n"),
            "a.yaml:3: unknown key 'cam0.intrinsic', did you mean 'cam0.intrinsics'?");
  EXPECT_EQ(error_of("\ncam0: {camera_model: pinhole}\n"),
            "a.yaml:2: cam0 has no resolution, which is needed");
  EXPECT_EQ(error_of("cam0: {resolution: [640, 480]}\n"),
            "a.yaml:1: cam0 has no camera_model, which is needed");
  EXPECT_EQ(error_of("cam0: {camera_model: pinhole, resolution: [640, 480]}\n"),
            "a.yaml:1: cam0: intrinsics has 0 numbers, expected 4: fu fv pu pv");
  EXPECT_EQ(error_of("cam0: pinhole\n"),
            "a.yaml:1: cam0 is pinhole, expected a section of KEY: VALUE");
  EXPECT_THAT(error_of(one_camera(", distortion_model: fov, distortion_coeffs: [0.9]")),
              StartsWith("a.yaml:1: cam0.distortion_model is fov, which is not supported"));
  EXPECT_THAT(error_of(one_camera(", distortion_coeffs: [0.1, .nan]")),
              HasSubstr("cam0.distortion_coeffs[1] is .nan, expected a number"));
  EXPECT_THAT(error_of("cam0: {camera_model: pinhole, resolution: [640]}\n"),
              EndsWith("cam0.resolution is a list of 1, expected [width, height] in pixels"));
  EXPECT_THAT(error_of("cam0: {camera_model: pinhole, resolution: [640.5, 480]}\n"),
              EndsWith("cam0.resolution[0] is 640.5, expected an integer of at least 1"));
}

TEST(Camchain, CamerasAreNumberedWithoutGaps) {
  const std::string plain = std::string("{") + kPlain + "}\n";
  EXPECT_THAT(error_of("cam1: " + plain), StartsWith("a.yaml:1: cam1 is given without cam0"));
  EXPECT_THAT(error_of("cam0: " + plain + "cam2: " + plain),
              StartsWith("a.yaml:2: cam2 is given without cam1"));
  EXPECT_THAT(error_of("cam0: " + plain + "cam00: " + plain),
              StartsWith("a.yaml:2: cam00 is given"));
  EXPECT_THAT(error_of("cam0: " + plain + "cam1: " + plain),
              EndsWith("cam1 has no T_cn_cnm1, which is needed"));
  EXPECT_THAT(error_of(one_camera(", T_cn_cnm1: []")),
              HasSubstr("cam0.T_cn_cnm1 is given, expected none"));
}

std::string transform_error(const std::string& matrix) {
  return error_of(one_camera("") + "cam1: {" + kPlain + ", T_cn_cnm1: " + matrix + "}\n");
}

TEST(Camchain, TransformationsAreChecked) {
  EXPECT_EQ(transform_error("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"),
            "no error");
  EXPECT_EQ(transform_error("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]"),
            "a.yaml:2: cam1.T_cn_cnm1 is a list of 3, expected 4 rows of 4 numbers");
  EXPECT_THAT(transform_error("[[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]"),
              EndsWith("expected 4 rows of 4 numbers"));
  EXPECT_THAT(transform_error("[1, 2, 3, 4]"), HasSubstr("cam1.T_cn_cnm1[0] is 1"));
  EXPECT_THAT(transform_error("5"), EndsWith("is 5, expected 4 rows of 4 numbers"));
  EXPECT_THAT(transform_error("[[1.01, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"),
              HasSubstr("has no rotation in its 3x3 part (off by 0.02)"));
  EXPECT_THAT(transform_error("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]"),
              HasSubstr("(mirrored)"));
  EXPECT_THAT(transform_error("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]"),
              HasSubstr("another last row than 0 0 0 1"));
}

TEST(Camchain, RoundedRotationsAreMadeExact) {
  Rng rng(2, 0);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond(rng.normal(), rng.normal(), rng.normal(), rng.normal()).normalized();
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
    for (int i = 0; i < 9; ++i) {
      double& value = matrix(i / 3, i % 3);
      value = std::round(value * 1e4) / 1e4;
    }
    matrix.topRightCorner<3, 1>() << 1.0, 2.0, 3.0;
    const Rigid3 rigid = rigid_from_matrix(matrix, "a", "T");
    EXPECT_NEAR(rigid.rotation.norm(), 1.0, 1e-15);
    EXPECT_LT(rigid.rotation.angularDistance(rotation), 2e-4);
    EXPECT_EQ(rigid.translation, Eigen::Vector3d(1.0, 2.0, 3.0));
  }
  Eigen::Matrix4d bad = Eigen::Matrix4d::Identity();
  bad(0, 3) = std::nan("");
  EXPECT_THROW(rigid_from_matrix(bad, "a", "T"), InputError);
}

}  // namespace
}  // namespace waymark

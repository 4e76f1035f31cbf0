// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "waymark/base/settings.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/config_file.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

constexpr const char* kImu =
    "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"
    "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2.0e-5\n"
    "rostopic: /imu0\nupdate_rate: 200.0\n";

constexpr const char* kCamera =
    "cam0:\n  camera_model: pinhole\n  intrinsics: [500, 500, 320, 240]\n  resolution: [640, 480]\n"
    "  T_cam_imu:\n  - [0, -1, 0, 0.1]\n  - [1, 0, 0, 0.2]\n  - [0, 0, 1, 0.3]\n  - [0, 0, 0, 1]\n"
    "  timeshift_cam_imu: -0.008\n";

struct NoSettings {
  template <class Self, class Field>
  static void describe(Self&, Field&&) {}
};

TEST(ImuCalibration, IsReadFromFilesOfKalibr) {
  const TemporaryFolder folder;
  folder.write("camchain-imucam.yaml", kCamera);
  folder.write("imu.yaml", kImu);
  std::vector<std::string> notes;
  const std::vector<std::filesystem::path> files = {folder / "camchain-imucam.yaml",
                                                    folder / "imu.yaml"};
  const ConfigNode config = merge_configs(read_config_files(files, notes));
  NoSettings settings;
  read_settings(settings, config);
  const ImuCalibration calibration = read_imu_calibration(config);
  EXPECT_THAT(notes, IsEmpty());
  ASSERT_TRUE(calibration.imu_from_rig);
  const Eigen::Vector3d origin = calibration.imu_from_rig->inverse().translation;
  EXPECT_LT((origin - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
  EXPECT_EQ(calibration.time_shift_s, -0.008);
  ASSERT_TRUE(calibration.noise);
  EXPECT_EQ(calibration.noise->gyroscope, 1.7e-4);
  EXPECT_EQ(calibration.noise->gyroscope_walk, 2.0e-5);
  EXPECT_EQ(calibration.noise->accelerometer, 2.0e-3);
  EXPECT_EQ(calibration.noise->accelerometer_walk, 3.0e-3);
}

/// As Kalibr writes it for the model "scale-misalignment".
TEST(ImuCalibration, CorrectsSamplesByScaleAndMisalignment) {
  const ImuCalibration calibration = read_imu_calibration(
      parse_config({"a.yaml",
                    "model: scale-misalignment\n"
                    "accelerometers:\n  M:\n  - [1.02, 0, 0]\n  - [0.01, 0.98, 0]\n  - [0, 0, 1]\n"
                    "gyroscopes:\n  A:\n  - [0, 0, 0.01]\n  - [0, 0, 0]\n  - [0, 0, 0]\n"
                    "  C_gyro_i:\n  - [0, -1, 0]\n  - [1, 0, 0]\n  - [0, 0, 1]\n"
                    "  M:\n  - [1.1, 0, 0]\n  - [0, 1, 0]\n  - [0.1, 0, 0.9]\n",
                    "imu0"}));
  // Turning by 1, 2, 3 rad/s (in axes of the gyroscope -2, 1, 3) and pushed by 0.5, 1, 10 m/s^2.
  const TemporaryFolder folder;
  folder.write("imu.csv",
               "t,wx,wy,wz,ax,ay,az\n0,-2.1,1,2.5,0.51,0.985,10\n0.01,-2.1,1,2.5,0.51,0.985,10\n");
  InputInfo info;
  take_imu(
      {.imu = folder / "imu.csv", .imu_calibration = calibration},
      [] { return std::nullopt; },
      info);
  ASSERT_TRUE(info.imu);
  const ImuSample& sample = info.imu->samples.front();
  EXPECT_LT((sample.angular_velocity - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((sample.acceleration - Eigen::Vector3d(0.5, 1, 10)).norm(), 1e-12);
  const auto error_of = [](const std::string& matrix) {
    const ConfigNode config =
        parse_config({"a.yaml", fmt::format("imu0: {{gyroscopes: {{M: {}}}}}", matrix)});
    return input_error_of([&] { read_imu_calibration(config); });
  };
  EXPECT_EQ(error_of("[[0, 0, 0], [0, 1, 0], [0, 0, 1]]"),
            "a.yaml:1: imu0.gyroscopes.M is singular, expected scales of about 1");
  EXPECT_EQ(error_of("[1, 2]"),
            "a.yaml:1: imu0.gyroscopes.M is a list of 2, expected 3 rows of 3 numbers");
}

TEST(ImuCalibration, IsNeededNowhere) {
  const ImuCalibration none = read_imu_calibration(parse_config({"a", "cam0: {}\n"}));
  EXPECT_FALSE(none.imu_from_rig || none.time_shift_s || none.noise);
  const ConfigNode bent = parse_config({"a.yaml", "cam0:\n  T_cam_imu: [1, 2]\n"});
  EXPECT_THAT(input_error_of([&] { read_imu_calibration(bent); }),
              HasSubstr("a.yaml:2: cam0.T_cam_imu is"));
  const ConfigNode part = parse_config({"a.yaml", "imu0:\n  gyroscope_noise_density: 1e-4\n"});
  EXPECT_THAT(input_error_of([&] { read_imu_calibration(part); }),
              HasSubstr("a.yaml:1: imu0 has no accelerometer_random_walk, expected all four"));
  ImuCalibration own;
  own.time_shift_s = 1.0;
  ImuCalibration other;
  other.time_shift_s = 2.0;
  other.noise = ImuNoise{};
  fill_in(own, other);
  EXPECT_EQ(own.time_shift_s, 1.0);
  EXPECT_TRUE(own.noise);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Inertial data of inputs: carried by them, given beside them, turned with them.
#include <gmock/gmock.h>

#include <numbers>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/imu_stream.h"
#include "waymark/input/input.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::Not;
using testing::TemporaryFolder;

constexpr const char* kTable =
    "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n1000000000,0,0,1,0,0,9.8\n1005000000,0,0,1,0,0,9.8\n"
    "1010000000,0,0,1,0,0,9.8\n";

/// Camera 0 is 0.5 m along x from the IMU, its x axis the IMU's y axis.
void make_data_set(const TemporaryFolder& folder) {
  folder.write("mav0/cam0/data.csv", "1000000000,a.png\n1010000000,b.png\n");
  folder.write("mav0/cam0/sensor.yaml",
               "T_BS:\n  cols: 4\n  rows: 4\n"
               "  data: [0, -1, 0, 0.5, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
               "resolution: [32, 24]\ncamera_model: pinhole\nintrinsics: [40, 41, 16, 12]\n");
  testing::write_image(folder / "mav0/cam0/data/a.png", 32, 24, 10);
  testing::write_image(folder / "mav0/cam0/data/b.png", 32, 24, 11);
  folder.write("mav0/imu0/data.csv", kTable);
  folder.write("mav0/imu0/sensor.yaml",
               "T_BS:\n  cols: 4\n  rows: 4\n"
               "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
               "rate_hz: 200\ngyroscope_noise_density: 1.7e-04\ngyroscope_random_walk: 1.9e-05\n"
               "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n");
}

TEST(ImuInput, IsCarriedByADataSet) {
  const TemporaryFolder folder;
  make_data_set(folder);
  const InputInfo info = open_input(folder.path(), {})->info();
  ASSERT_TRUE(info.imu);
  EXPECT_EQ(info.imu->samples.size(), 3U);
  ASSERT_TRUE(info.imu->calibration.imu_from_rig);
  const Rigid3& imu_from_rig = *info.imu->calibration.imu_from_rig;
  EXPECT_LT((imu_from_rig.translation - Eigen::Vector3d(0.5, 0, 0)).norm(), 1e-12);
  EXPECT_LT((imu_from_rig.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(),
            1e-12);
  EXPECT_EQ(info.imu->calibration.noise->accelerometer, 2.0e-3);
  EXPECT_THAT(info.lines, Contains(HasSubstr("inertial data: 3 samples of")));
  const InputInfo none = open_input(folder.path(), {.imu = "none"})->info();
  EXPECT_FALSE(none.imu);
  EXPECT_THAT(none.lines, Each(Not(HasSubstr("inertial"))));
}

TEST(ImuInput, IsTurnedWithTheImages) {
  const TemporaryFolder folder;
  make_data_set(folder);
  const InputInfo info = open_input(folder.path(), {.resize_px = 16, .rotate_deg = 90})->info();
  ASSERT_TRUE(info.imu);
  // Images turned clockwise: their x axis is what pointed up, -y, before.
  const Eigen::Vector3d x = info.imu->calibration.imu_from_rig->rotation * Eigen::Vector3d::UnitX();
  EXPECT_LT((x - Eigen::Vector3d::UnitX()).norm(), 1e-9);
}

TEST(ImuInput, IsReadFromAFileBeside) {
  const TemporaryFolder folder;
  testing::write_image(folder / "images/0.png", 32, 24, 10);
  folder.write("imu.csv", kTable);
  InputOptions options;
  EXPECT_FALSE(open_input(folder / "images", options)->info().imu);
  options.imu = folder / "imu.csv";
  options.imu_calibration.time_shift_s = 0.02;
  const InputInfo info = open_input(folder / "images", options)->info();
  ASSERT_TRUE(info.imu);
  EXPECT_EQ(info.imu->calibration.time_shift_s, 0.02);
  options.imu = folder / "missing.csv";
  EXPECT_THAT(input_error_of([&] { open_input(folder / "images", options); }),
              HasSubstr("missing.csv: "));
  EXPECT_THAT(input_error_of([&] { open_input("camera:0", options); }),
              HasSubstr("--imu: cannot go with an input of kind camera, expected a recording"));
}

TEST(ImuInput, OfAnotherClockThanThatOfAVideoIsTold) {
  const TemporaryFolder folder;
  folder.write("imu.csv",
               "t,gx,gy,gz,ax,ay,az\n1700000000.000,0,0,1,0,0,9.8\n1700000000.005,0,0,1,0,0,9.8\n");
  InputInfo info;
  info.format = "video";
  take_imu(
      {.imu = folder / "imu.csv"}, [] { return std::nullopt; }, info);
  ASSERT_TRUE(info.imu);
  EXPECT_THAT(info.imu->notes, Contains(HasSubstr("these at 1700000000.000000000 s: another")));
}

TEST(ImuInput, OfNoUseIsNoFaultOfTheImages) {
  const TemporaryFolder folder;
  make_data_set(folder);
  folder.write("mav0/imu0/data.csv", "garbage");
  const InputInfo info = open_input(folder.path(), {})->info();
  EXPECT_FALSE(info.imu);
  EXPECT_EQ(info.num_frames, 2U);
  EXPECT_THAT(info.lines, Contains(HasSubstr("note: inertial data are left out: ")));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/imu_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string parse_failure(const std::vector<std::string>& words) {
  try {
    parse_imu(words);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ImuDevice, NamesAreKnownAndWorseDevicesHaveLargerErrors) {
  for (const std::string& name : imu_names()) {
    const ImuDevice imu = parse_imu({name});
    EXPECT_EQ(imu.rate_hz, 200.0);
    EXPECT_EQ(imu.gyroscope.noise_density > 0.0, name != "perfect");
    EXPECT_EQ(std::isfinite(imu.accelerometer.range), name != "perfect");
    EXPECT_EQ(imu.vibration, 0.0);
  }
  EXPECT_GT(parse_imu({"phone"}).gyroscope.bias, parse_imu({"mems"}).gyroscope.bias);
  EXPECT_EQ(parse_imu({"mems"}).gyroscope.random_walk, 1.9393e-5);
}

TEST(ImuDevice, KeysReplaceWhatTheNameSays) {
  const ImuDevice imu = parse_imu({"phone",
                                   "update_rate=400",
                                   "shift=-20",
                                   "turn_z=90",
                                   "lever_x=5",
                                   "gyroscope_bias=0",
                                   "vibration=3"});
  EXPECT_EQ(imu.rate_hz, 400.0);
  EXPECT_EQ(imu.gyroscope.bias, 0.0);
  EXPECT_EQ(imu.vibration, 3.0);
  const ImuCalibration calibration = imu.calibration();
  EXPECT_DOUBLE_EQ(*calibration.time_shift_s, -0.02);
  EXPECT_EQ(calibration.noise->gyroscope, parse_imu({"phone"}).gyroscope.noise_density);
  // It stands to the right of the camera; its x axis points down.
  const Rigid3 rig_from_imu = calibration.imu_from_rig->inverse();
  EXPECT_LT((rig_from_imu.translation - Eigen::Vector3d(0.05, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((rig_from_imu.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(),
            1e-12);
}

TEST(ImuDevice, NamesWhatCannotBe) {
  EXPECT_THAT(parse_failure({}), HasSubstr("expected one of perfect, mems, phone"));
  EXPECT_THAT(parse_failure({"shift=1"}), HasSubstr("begins with 'shift=1'"));
  EXPECT_THAT(parse_failure({"fone"}), HasSubstr("fone"));
  EXPECT_THAT(parse_failure({"phone", "shft=1"}), HasSubstr("did you mean 'shift'?"));
  EXPECT_THAT(parse_failure({"phone", "shift"}), HasSubstr("--imu: shift is"));
  EXPECT_THAT(parse_failure({"phone", "update_rate=0"}), HasSubstr("expected a number from 1 to"));
  EXPECT_THAT(parse_failure({"phone", "gyroscope_bias=nan"}), HasSubstr("expected a number"));
}

}  // namespace
}  // namespace waymark

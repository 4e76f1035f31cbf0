// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_imu.h"

#include <vector>

#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

using Vectors = std::vector<Eigen::Vector3d>;

constexpr NumberRange kSigmaRange{0.0, 1e6};
constexpr NumberRange kTimeShiftRange{-1e3, 1e3};     // s
constexpr NumberRange kAccelerationRange{-1e3, 1e3};  // m/s^2
constexpr NumberRange kRateRange{-1e3, 1e3};          // rad/s

}  // namespace

void write_imu(MapRecordWriter& writer, const std::optional<InertialReport>& report) {
  if (!report || !report->is_used) return;
  const InertialReport& imu = *report;
  writer.begin("imu", 0);
  writer.add_transform("imu_from_rig", imu.imu_from_rig);
  writer.add_number("rotation_sigma_rad", imu.rotation_sigma_rad, kSigmaRange);
  writer.add_number("lever_arm_sigma_m", imu.lever_arm_sigma_m, kSigmaRange);
  writer.add_number("time_shift_s", imu.time_shift_s, kTimeShiftRange);
  writer.add_number("time_shift_sigma_s", imu.time_shift_sigma_s, kSigmaRange);
  writer.add_array("gyroscope_bias", Vectors{imu.biases.gyroscope}, kRateRange);
  writer.add_array("accelerometer_bias", Vectors{imu.biases.accelerometer}, kAccelerationRange);
  writer.add_array("gravity_in_world", Vectors{imu.gravity_in_world}, kAccelerationRange);
  writer.add_number("gravity_sigma_rad", imu.gravity_sigma_rad, kSigmaRange);
  writer.add_number("scale_sigma", imu.scale_sigma, kSigmaRange);
  writer.end();
}

InertialReport read_imu(MapRecord& record) {
  const auto vector = [&](std::string_view key, const NumberRange& range) {
    return record.array<Eigen::Vector3d>(key, 1, range).front();
  };
  InertialReport imu;
  imu.is_used = true;
  imu.imu_from_rig = record.transform("imu_from_rig");
  imu.rotation_sigma_rad = record.number("rotation_sigma_rad", kSigmaRange);
  imu.lever_arm_sigma_m = record.number("lever_arm_sigma_m", kSigmaRange);
  imu.time_shift_s = record.number("time_shift_s", kTimeShiftRange);
  imu.time_shift_sigma_s = record.number("time_shift_sigma_s", kSigmaRange);
  imu.biases.gyroscope = vector("gyroscope_bias", kRateRange);
  imu.biases.accelerometer = vector("accelerometer_bias", kAccelerationRange);
  imu.gravity_in_world = vector("gravity_in_world", kAccelerationRange);
  imu.gravity_sigma_rad = record.number("gravity_sigma_rad", kSigmaRange);
  imu.scale_sigma = record.number("scale_sigma", kSigmaRange);
  return imu;
}

}  // namespace waymark

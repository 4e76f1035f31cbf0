// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/imu_dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/text.h"

namespace waymark {
namespace {

std::string comma_separated(const Eigen::Vector3d& vector) {
  return fmt::format(
      "{},{},{}", unsigned_zero(vector.x()), unsigned_zero(vector.y()), unsigned_zero(vector.z()));
}

/// The lines of a camera that say how the IMU is mounted to it.
std::string format_mounting(const ChainCamera& camera, const ImuCalibration& told) {
  std::string text;
  if (told.imu_from_rig) {
    const Eigen::Matrix4d cam_from_imu =
        (camera.cam_from_rig * told.imu_from_rig->inverse()).matrix().unaryExpr(&unsigned_zero);
    text += "  T_cam_imu:\n";
    for (int row = 0; row < 4; ++row) {
      text += fmt::format("  - [{}]\n", fmt::join(cam_from_imu.row(row), ", "));
    }
  }
  if (told.time_shift_s) text += fmt::format("  timeshift_cam_imu: {}\n", *told.time_shift_s);
  return text;
}

}  // namespace

std::string format_imu_samples(std::span<const RecordedImuSample> samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const RecordedImuSample& recorded : samples) {
    const ImuSample& sample = recorded.sample;
    text += fmt::format("{},{},{}\n",
                        sample.timestamp_ns,
                        comma_separated(sample.angular_velocity),
                        comma_separated(sample.acceleration));
  }
  return text;
}

std::string format_imu_truth(std::span<const RecordedImuSample> samples) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const RecordedImuSample& recorded : samples) {
    const Eigen::Quaterniond& rotation = recorded.world_from_imu.rotation;
    text += fmt::format("{},{},{},{},{},{},{}\n",
                        recorded.sample.timestamp_ns,
                        comma_separated(recorded.world_from_imu.translation),
                        unsigned_zero(rotation.w()),
                        comma_separated(rotation.vec()),
                        comma_separated(recorded.velocity),
                        comma_separated(recorded.gyroscope_bias),
                        comma_separated(recorded.accelerometer_bias));
  }
  return text;
}

std::string format_imu_mounting(const Rigid3& imu_from_rig) {
  const Eigen::Matrix4d body_from_imu = imu_from_rig.inverse().matrix().unaryExpr(&unsigned_zero);
  return fmt::format("sensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n",
                     fmt::join(body_from_imu.reshaped<Eigen::RowMajor>(), ", "));
}

std::string format_imu_noise(const ImuNoise& noise, double rate_hz) {
  return fmt::format(
      "gyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
      "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n"
      "rostopic: /imu0\nupdate_rate: {}\n",
      noise.gyroscope,
      noise.gyroscope_walk,
      noise.accelerometer,
      noise.accelerometer_walk,
      rate_hz);
}

std::string format_camchain_imu(const CameraChain& chain, const ImuCalibration& told) {
  std::string text = format_camchain(chain);
  for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
    const std::string section = fmt::format("cam{}:\n", i);
    text.insert(text.find(section) + section.size(), format_mounting(chain.cameras[i], told));
  }
  return text;
}

}  // namespace waymark

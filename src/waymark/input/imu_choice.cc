// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What is known of the IMU of an input, and which inertial data it gets.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

constexpr std::array<std::pair<const char*, double ImuNoise::*>, 4> kNoiseKeys = {
    {{"gyroscope_noise_density", &ImuNoise::gyroscope},
     {"accelerometer_noise_density", &ImuNoise::accelerometer},
     {"gyroscope_random_walk", &ImuNoise::gyroscope_walk},
     {"accelerometer_random_walk", &ImuNoise::accelerometer_walk}}};

/// All four numbers or none.
std::optional<ImuNoise> read_noise(const ConfigNode& imu) {
  ImuNoise noise;
  std::vector<const char*> missing;
  for (const auto& [name, value] : kNoiseKeys) {
    const ConfigNode* const node = imu.find(name);
    if (!node) missing.push_back(name);
    if (node) noise.*value = config_double(*node, fmt::format("imu0.{}", name), {0.0, 1e3});
  }
  if (missing.empty()) return noise;
  if (missing.size() == kNoiseKeys.size()) return std::nullopt;
  throw InputError(
      imu.where(),
      fmt::format("imu0 has no {}, expected all four numbers of its noise", missing.back()));
}

/// A matrix of a sensor of the section imu0, else the usual one.
Eigen::Matrix3d read_sensor_matrix(const ConfigNode& imu,
                                   const std::string& sensor,
                                   const std::string& name,
                                   const Eigen::Matrix3d& usual) {
  const ConfigNode* const section = imu.find(sensor);
  const ConfigNode* const node = section ? section->find(name) : nullptr;
  if (!node) return usual;
  const std::string key = fmt::format("imu0.{}.{}", sensor, name);
  const Eigen::Matrix3d matrix = read_square_matrix(*node, key, 3);
  if (name == "A" || std::abs(matrix.determinant()) > 0.1) return matrix;
  throw InputError(node->where(), key + " is singular, expected scales of about 1");
}

/// Of the model "scale-misalignment" of Kalibr, which others do not have.
std::optional<ImuIntrinsics> read_intrinsics(const ConfigNode& imu) {
  if (!imu.find("gyroscopes") && !imu.find("accelerometers")) return std::nullopt;
  const Eigen::Matrix3d none = Eigen::Matrix3d::Zero(), one = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d turn = read_sensor_matrix(imu, "gyroscopes", "C_gyro_i", one);
  return ImuIntrinsics{read_sensor_matrix(imu, "gyroscopes", "M", one) * turn,
                       read_sensor_matrix(imu, "gyroscopes", "A", none) * turn,
                       read_sensor_matrix(imu, "accelerometers", "M", one)};
}

void correct(const ImuIntrinsics& intrinsics, ImuStream& stream) {
  const Eigen::Matrix3d from_gyroscope = intrinsics.gyroscope.inverse();
  const Eigen::Matrix3d from_accelerometer = intrinsics.accelerometer.inverse();
  for (ImuSample& sample : stream.samples) {
    sample.acceleration = from_accelerometer * sample.acceleration;
    sample.angular_velocity = from_gyroscope * (sample.angular_velocity -
                                                intrinsics.by_acceleration * sample.acceleration);
  }
  stream.notes.emplace_back("corrected by the scale and misalignment that are stated");
}

}  // namespace

ImuCalibration read_imu_calibration(const ConfigNode& config) {
  ImuCalibration calibration;
  const ConfigNode* const camera = config.find("cam0");
  if (const ConfigNode* const transform = camera ? camera->find("T_cam_imu") : nullptr) {
    calibration.imu_from_rig = read_transform(*transform, "cam0.T_cam_imu").inverse();
  }
  if (const ConfigNode* const shift = camera ? camera->find("timeshift_cam_imu") : nullptr) {
    calibration.time_shift_s = config_double(*shift, "cam0.timeshift_cam_imu", {-1e3, 1e3});
  }
  if (const ConfigNode* const imu = config.find("imu0")) {
    calibration.noise = read_noise(*imu);
    calibration.intrinsics = read_intrinsics(*imu);
  }
  return calibration;
}

void fill_in(ImuCalibration& calibration, const ImuCalibration& other) {
  if (!calibration.imu_from_rig) calibration.imu_from_rig = other.imu_from_rig;
  if (!calibration.time_shift_s) calibration.time_shift_s = other.time_shift_s;
  if (!calibration.noise) calibration.noise = other.noise;
  if (!calibration.intrinsics) calibration.intrinsics = other.intrinsics;
}

void take_imu(const InputOptions& options,
              const std::function<std::optional<ImuStream>()>& carried,
              InputInfo& info) {
  if (options.imu == "none") return;
  std::optional<ImuStream> stream;
  try {
    stream = options.imu.empty() ? carried() : read_imu_file(options.imu);
  } catch (const InputError& error) {
    if (!options.imu.empty()) throw;
    info.lines.push_back(fmt::format("note: inertial data are left out: {}", error.what()));
  }
  if (!stream) return;
  const ImuCalibration known = std::exchange(stream->calibration, options.imu_calibration);
  fill_in(stream->calibration, known);
  if (stream->calibration.intrinsics) correct(*stream->calibration.intrinsics, *stream);
  // No recording is that long.
  constexpr std::int64_t kDayNs = 86'400'000'000'000;
  const std::int64_t first_ns = stream->samples.front().timestamp_ns;
  if (info.format == "video" && info.times_ns.empty() && first_ns > kDayNs) {
    stream->notes.push_back(
        fmt::format("note: times of the video begin at 0, these at {} s: another clock",
                    format_seconds(first_ns)));
  }
  info.lines.push_back(fmt::format(
      "inertial data: {} of {}", count_of(stream->samples.size(), "sample"), stream->source));
  info.imu = std::make_shared<const ImuStream>(*std::move(stream));
}

void turn_imu(InputInfo& info, int num_quarters) {
  if (!info.imu || !info.imu->calibration.imu_from_rig) return;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(-0.5 * std::numbers::pi * num_quarters, Eigen::Vector3d::UnitZ()));
  ImuStream turned = *info.imu;
  Rigid3& imu_from_rig = *turned.calibration.imu_from_rig;
  imu_from_rig = imu_from_rig * Rigid3(turn, Eigen::Vector3d::Zero());
  info.imu = std::make_shared<const ImuStream>(std::move(turned));
}

}  // namespace waymark

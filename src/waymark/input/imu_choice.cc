// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What is known of the IMU of an input, and which inertial data it gets.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/datasets.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

struct NoiseKey {
  const char* name;
  double ImuNoise::*value;
};
constexpr std::array<NoiseKey, 4> kNoiseKeys = {
    {{"gyroscope_noise_density", &ImuNoise::gyroscope},
     {"accelerometer_noise_density", &ImuNoise::accelerometer},
     {"gyroscope_random_walk", &ImuNoise::gyroscope_walk},
     {"accelerometer_random_walk", &ImuNoise::accelerometer_walk}}};

}  // namespace

std::optional<ImuNoise> read_imu_noise(const ConfigNode& node, const std::string& key) {
  constexpr ConfigRange kRange{.low = 0.0, .high = 1e3};
  ImuNoise noise;
  std::size_t num_found = 0;
  const char* missing = nullptr;
  for (const NoiseKey& part : kNoiseKeys) {
    const ConfigNode* const value = node.find(part.name);
    if (!value) {
      missing = part.name;
      continue;
    }
    noise.*part.value = config_double(*value, fmt::format("{}.{}", key, part.name), kRange);
    ++num_found;
  }
  if (num_found == 0) return std::nullopt;
  if (!missing) return noise;
  throw InputError(
      node.where(),
      fmt::format("{} has no {}, expected all four numbers of its noise", key, missing));
}

ImuCalibration read_imu_calibration(const ConfigNode& config) {
  ImuCalibration calibration;
  const ConfigNode* const camera = config.find("cam0");
  if (const ConfigNode* const transform = camera ? camera->find("T_cam_imu") : nullptr) {
    calibration.imu_from_rig = read_transform(*transform, "cam0.T_cam_imu").inverse();
  }
  if (const ConfigNode* const shift = camera ? camera->find("timeshift_cam_imu") : nullptr) {
    calibration.time_shift_s =
        config_double(*shift, "cam0.timeshift_cam_imu", {.low = -1e3, .high = 1e3});
  }
  const ConfigNode* const imu = config.find("imu0");
  if (imu) calibration.noise = read_imu_noise(*imu, "imu0");
  return calibration;
}

void fill_in(ImuCalibration& calibration, const ImuCalibration& other) {
  if (!calibration.imu_from_rig) calibration.imu_from_rig = other.imu_from_rig;
  if (!calibration.time_shift_s) calibration.time_shift_s = other.time_shift_s;
  if (!calibration.noise) calibration.noise = other.noise;
}

std::optional<ImuStream> read_euroc_imu(const std::filesystem::path& folder) {
  const std::filesystem::path mav0 =
      std::filesystem::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  const std::filesystem::path table = mav0 / "imu0" / "data.csv";
  if (!std::filesystem::is_regular_file(table)) return std::nullopt;
  ImuStream stream = read_imu_file(table);
  const auto config_of = [](const std::filesystem::path& path) {
    constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
    return parse_config({path.string(), read_text_file(path, "a YAML file", kMaxBytes)});
  };
  const std::filesystem::path sensor = table.parent_path() / "sensor.yaml";
  const bool has_sensor = std::filesystem::exists(sensor);
  if (has_sensor) stream.calibration.noise = read_imu_noise(config_of(sensor), "the IMU");
  if (has_sensor && std::filesystem::exists(mav0 / "cam0" / "sensor.yaml")) {
    stream.calibration.imu_from_rig = euroc_sensor_from_camera0(table);
  }
  // Of TUM-VI.
  const std::filesystem::path dso = (mav0 / ".." / "dso").lexically_normal();
  if (std::filesystem::exists(dso / "camchain.yaml")) {
    fill_in(stream.calibration, read_imu_calibration(config_of(dso / "camchain.yaml")));
  }
  if (!stream.calibration.noise && std::filesystem::exists(dso / "imu_config.yaml")) {
    stream.calibration.noise = read_imu_noise(config_of(dso / "imu_config.yaml"), "the IMU");
  }
  return stream;
}

void take_imu(const InputOptions& options,
              const std::function<std::optional<ImuStream>()>& carried,
              InputInfo& info) {
  std::optional<ImuStream> stream;
  if (options.imu == "none") return;
  if (!options.imu.empty()) {
    stream = read_imu_file(options.imu);
  } else {
    try {
      stream = carried();
    } catch (const InputError& error) {
      info.lines.push_back(fmt::format("note: inertial data are left out: {}", error.what()));
    }
  }
  if (!stream) return;
  ImuCalibration calibration = options.imu_calibration;
  fill_in(calibration, stream->calibration);
  stream->calibration = calibration;
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

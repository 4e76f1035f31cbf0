// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <optional>
#include <string>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/camera/camchain.h"
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

}  // namespace waymark

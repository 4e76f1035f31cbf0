// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_calibration.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <string>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/camera/camchain.h"

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

bool is_imu_document(const ConfigNode& config) {
  return config.find(kNoiseKeys[0].name) || config.find(kNoiseKeys[1].name);
}

std::optional<ImuNoise> read_imu_noise(const ConfigNode& node, const std::string& key) {
  constexpr ConfigRange kRange{.low = 0.0, .high = 1e3};
  ImuNoise noise;
  const char* missing = nullptr;
  bool has_any = false;
  for (const NoiseKey& part : kNoiseKeys) {
    const ConfigNode* const value = node.find(part.name);
    if (value) {
      noise.*part.value = config_double(*value, fmt::format("{}.{}", key, part.name), kRange);
      has_any = true;
    } else {
      missing = part.name;
    }
  }
  if (!has_any) return std::nullopt;
  if (!missing) return noise;
  throw InputError(
      node.where(),
      fmt::format("{} has no {}, expected all four numbers of its noise", key, missing));
}

ImuCalibration read_imu_calibration(const ConfigNode& config, std::vector<std::string>& notes) {
  ImuCalibration calibration;
  if (const ConfigNode* const camera = config.find("cam0")) {
    if (const ConfigNode* const transform = camera->find("T_cam_imu")) {
      // No camera needs it, so that it is no reason to refuse one.
      try {
        calibration.imu_from_rig = read_transform(*transform, "cam0.T_cam_imu").inverse();
      } catch (const InputError& error) {
        notes.push_back(fmt::format("{}; it is ignored", error.what()));
      }
    }
    if (const ConfigNode* const shift = camera->find("timeshift_cam_imu")) {
      calibration.time_shift_s =
          config_double(*shift, "cam0.timeshift_cam_imu", {.low = -1e3, .high = 1e3});
    }
  }
  if (const ConfigNode* const imu = config.find("imu0")) {
    calibration.noise = read_imu_noise(*imu, "imu0");
  }
  return calibration;
}

void fill_in(ImuCalibration& calibration, const ImuCalibration& other) {
  if (!calibration.imu_from_rig) calibration.imu_from_rig = other.imu_from_rig;
  if (!calibration.time_shift_s) calibration.time_shift_s = other.time_shift_s;
  if (!calibration.noise) calibration.noise = other.noise;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/imu_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

constexpr double kRadPerMountDeg = std::numbers::pi / 180.0;
constexpr double kOneG = kStandardGravity;
constexpr const char* kImuOption = "--imu";

/// Burri et al. 2016 (sensor.yaml) for noise and walks; the rest from the data sheet of the
/// ADIS16448: bias repeatability .5 deg/s and 20 mg, sensitivity 1 %, as standard deviations.
ImuDevice mems() {
  ImuDevice imu;
  imu.noise = {1.6968e-4, 2.0e-3, 1.9393e-5, 3.0e-3};
  imu.gyroscope_bias = 0.5 * kRadPerMountDeg;
  imu.accelerometer_bias = 0.02 * kOneG;
  imu.gyroscope_scale = imu.accelerometer_scale = 0.003;
  imu.gyroscope_range = 1000.0 * kRadPerMountDeg;
  imu.accelerometer_range = 18.0 * kOneG;
  return imu;
}

/// Densities and ranges from the data sheet of the BMI160 (.007 deg/s and 180 ug per sqrt(Hz));
/// walks of the same device in Schubert et al. 2018. Its zero offsets (3 deg/s, 40 mg) are taken
/// for three standard deviations, since phones calibrate themselves when they rest.
ImuDevice phone() {
  ImuDevice imu;
  imu.noise = {0.007 * kRadPerMountDeg, 180e-6 * kOneG, 2.2e-6, 8.6e-5};
  imu.gyroscope_bias = 1.0 * kRadPerMountDeg;
  imu.accelerometer_bias = 0.04 / 3.0 * kOneG;
  imu.gyroscope_scale = imu.accelerometer_scale = 0.005;
  imu.gyroscope_range = 2000.0 * kRadPerMountDeg;
  imu.accelerometer_range = 8.0 * kOneG;
  return imu;
}

/// Data sheet of the MPU-6050: .005 deg/s and 400 ug per sqrt(Hz); tolerances of 20 deg/s, 50 mg
/// and 3 % are taken for three standard deviations. It says nothing of walks: ten times those of
/// the phone.
ImuDevice consumer() {
  ImuDevice imu;
  imu.noise = {0.005 * kRadPerMountDeg, 400e-6 * kOneG, 2.2e-5, 8.6e-4};
  imu.gyroscope_bias = 20.0 / 3.0 * kRadPerMountDeg;
  imu.accelerometer_bias = 0.05 / 3.0 * kOneG;
  imu.gyroscope_scale = imu.accelerometer_scale = 0.01;
  imu.gyroscope_range = 500.0 * kRadPerMountDeg;
  imu.accelerometer_range = 4.0 * kOneG;
  return imu;
}

struct NamedImu {
  std::string_view name;
  ImuDevice (*make)();
};

constexpr std::array<NamedImu, 4> kImus = {{{"perfect", [] { return ImuDevice{}; }},
                                            {"mems", mems},
                                            {"phone", phone},
                                            {"consumer", consumer}}};

struct ImuKey {
  std::string_view name;
  double* (*number)(ImuDevice& imu);
  double unit = 1.0;  ///< In SI units.
  ConfigRange range = {.low = 0.0, .high = 1e3};
};

constexpr ConfigRange kTurns = {.low = -180.0, .high = 180.0};
constexpr ConfigRange kLevers = {.low = -1000.0, .high = 1000.0};
constexpr ConfigRange kShifts = {.low = -500.0, .high = 500.0};
constexpr ConfigRange kRates = {.low = 1.0, .high = 1e4};
constexpr ConfigRange kLimits = {.low = 1e-3, .high = 1e9};

constexpr std::array<ImuKey, 19> kKeys = {{
    {"update_rate", [](ImuDevice& imu) { return &imu.rate_hz; }, 1.0, kRates},
    {"gyroscope_noise_density", [](ImuDevice& imu) { return &imu.noise.gyroscope; }},
    {"gyroscope_random_walk", [](ImuDevice& imu) { return &imu.noise.gyroscope_walk; }},
    {"gyroscope_bias", [](ImuDevice& imu) { return &imu.gyroscope_bias; }},
    {"gyroscope_scale", [](ImuDevice& imu) { return &imu.gyroscope_scale; }},
    {"gyroscope_range", [](ImuDevice& imu) { return &imu.gyroscope_range; }, 1.0, kLimits},
    {"accelerometer_noise_density", [](ImuDevice& imu) { return &imu.noise.accelerometer; }},
    {"accelerometer_random_walk", [](ImuDevice& imu) { return &imu.noise.accelerometer_walk; }},
    {"accelerometer_bias", [](ImuDevice& imu) { return &imu.accelerometer_bias; }},
    {"accelerometer_scale", [](ImuDevice& imu) { return &imu.accelerometer_scale; }},
    {"accelerometer_range", [](ImuDevice& imu) { return &imu.accelerometer_range; }, 1.0, kLimits},
    {"vibration", [](ImuDevice& imu) { return &imu.vibration; }},
    {"turn_x", [](ImuDevice& imu) { return &imu.turn_rad.x(); }, kRadPerMountDeg, kTurns},
    {"turn_y", [](ImuDevice& imu) { return &imu.turn_rad.y(); }, kRadPerMountDeg, kTurns},
    {"turn_z", [](ImuDevice& imu) { return &imu.turn_rad.z(); }, kRadPerMountDeg, kTurns},
    {"lever_x", [](ImuDevice& imu) { return &imu.lever_m.x(); }, 1e-2, kLevers},
    {"lever_y", [](ImuDevice& imu) { return &imu.lever_m.y(); }, 1e-2, kLevers},
    {"lever_z", [](ImuDevice& imu) { return &imu.lever_m.z(); }, 1e-2, kLevers},
    {"shift", [](ImuDevice& imu) { return &imu.time_shift_s; }, 1e-3, kShifts},
}};

std::vector<std::string> key_names() {
  std::vector<std::string> names;
  for (const ImuKey& key : kKeys) names.emplace_back(key.name);
  return names;
}

/// Sets what a key of a file or of the option says; false for a key that nobody knows.
bool set_number(const ConfigNode& value, std::string_view name, ImuDevice& imu) {
  const auto key = std::ranges::find(kKeys, name, &ImuKey::name);
  if (key == kKeys.end()) return false;
  *key->number(imu) = key->unit * config_double(value, name, key->range);
  return true;
}

ImuDevice read_imu_file(const std::string& file) {
  const ConfigNode config = parse_config(ConfigSource::from_file(file));
  const ConfigNode* section = config.find("imu0");
  const ConfigNode& node = section == nullptr ? config : *section;
  constexpr std::array<std::string_view, 4> kIgnored = {
      "rostopic", "model", "T_i_b", "time_offset"};
  ImuDevice imu;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    if (set_number(node.items[i], node.keys[i], imu)) continue;
    if (std::ranges::find(kIgnored, node.keys[i]) != kIgnored.end()) continue;
    fail_unknown_key(node.items[i], node.keys[i], key_names());
  }
  return imu;
}

ImuDevice named_imu(const std::string& name) {
  const auto found = std::ranges::find(kImus, name, &NamedImu::name);
  return found == kImus.end() ? read_imu_file(name) : found->make();
}

}  // namespace

ImuCalibration ImuDevice::calibration() const {
  const Rigid3 rig_from_imu(so3_exp(turn_rad), lever_m);
  return {rig_from_imu.inverse(), time_shift_s, noise};
}

std::vector<std::string> imu_names() {
  std::vector<std::string> names;
  for (const NamedImu& imu : kImus) names.emplace_back(imu.name);
  return names;
}

ImuDevice parse_imu(const std::vector<std::string>& words) {
  if (words.empty() || words[0].find('=') != std::string::npos) {
    throw InputError(kImuOption,
                     fmt::format("begins with no name, expected a file or one of {}",
                                 fmt::join(imu_names(), ", ")));
  }
  ImuDevice imu = named_imu(words[0]);
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    ConfigNode value;
    value.kind = ConfigNode::Kind::kScalar;
    value.file = std::make_shared<const std::string>(kImuOption);
    if (equals != std::string::npos) value.scalar = words[i].substr(equals + 1);
    if (set_number(value, std::string_view(words[i]).substr(0, equals), imu)) continue;
    throw InputError(kImuOption,
                     fmt::format("{} is unknown, expected KEY=VALUE with one of {}",
                                 quote_for_message(words[i]),
                                 fmt::join(key_names(), ", ")));
  }
  return imu;
}

}  // namespace waymark

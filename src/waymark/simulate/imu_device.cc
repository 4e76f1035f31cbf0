// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/imu_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr double kRadPerMountDeg = std::numbers::pi / 180.0;
constexpr const char* kImuOption = "--imu";

/// Burri et al. 2016 (sensor.yaml) for noise and walks; the rest from the data sheet of the
/// ADIS16448: bias repeatability .5 deg/s and 20 mg as standard deviations, sensitivity 1 % for
/// three of them.
ImuDevice mems() {
  ImuDevice imu;
  imu.gyroscope = {1.6968e-4, 1.9393e-5, 0.5 * kRadPerMountDeg, 0.003, 1000.0 * kRadPerMountDeg};
  imu.accelerometer = {2.0e-3, 3.0e-3, 0.02 * kStandardGravity, 0.003, 18.0 * kStandardGravity};
  return imu;
}

/// Densities and ranges from the data sheet of the BMI160 (.007 deg/s and 180 ug per sqrt(Hz));
/// walks of the same device in Schubert et al. 2018. Its zero offsets (3 deg/s, 40 mg) are taken
/// for three standard deviations; the error of the scales is assumed.
ImuDevice phone() {
  ImuDevice imu;
  imu.gyroscope = {
      0.007 * kRadPerMountDeg, 2.2e-6, 1.0 * kRadPerMountDeg, 0.005, 2000.0 * kRadPerMountDeg};
  imu.accelerometer = {180e-6 * kStandardGravity,
                       8.6e-5,
                       0.04 / 3.0 * kStandardGravity,
                       0.005,
                       8.0 * kStandardGravity};
  return imu;
}

struct NamedImu {
  std::string_view name;
  ImuDevice (*make)();
};

constexpr std::array<NamedImu, 3> kImus = {
    {{"perfect", [] { return ImuDevice{}; }}, {"mems", mems}, {"phone", phone}}};

/// A number of a device, by its name in the option.
struct ImuKey {
  std::string name;
  double* number;
  double unit = 1.0;  ///< In SI units.
  ConfigRange range = {.low = 0.0, .high = 1e3};
};

std::vector<ImuKey> keys_of(ImuDevice& imu) {
  constexpr ConfigRange kTurns = {.low = -180.0, .high = 180.0};
  constexpr ConfigRange kLevers = {.low = -1000.0, .high = 1000.0};
  std::vector<ImuKey> keys = {{"update_rate", &imu.rate_hz, 1.0, {.low = 1.0, .high = 1e4}},
                              {"vibration", &imu.vibration},
                              {"shift", &imu.time_shift_s, 1e-3, {.low = -500.0, .high = 500.0}}};
  for (ImuAxes* axes : {&imu.gyroscope, &imu.accelerometer}) {
    const std::string sensor = axes == &imu.gyroscope ? "gyroscope_" : "accelerometer_";
    keys.push_back({sensor + "noise_density", &axes->noise_density});
    keys.push_back({sensor + "random_walk", &axes->random_walk});
    keys.push_back({sensor + "bias", &axes->bias});
    keys.push_back({sensor + "scale", &axes->scale});
    keys.push_back({sensor + "range", &axes->range});
  }
  for (int i = 0; i < 3; ++i) {
    keys.push_back({std::string("turn_") + "xyz"[i], &imu.turn_rad[i], kRadPerMountDeg, kTurns});
    keys.push_back({std::string("lever_") + "xyz"[i], &imu.lever_m[i], 1e-2, kLevers});
  }
  return keys;
}

/// Sets what a key says.
void set_number(const ConfigNode& value, const std::string& name, ImuDevice& imu) {
  std::vector<std::string> names;
  for (const ImuKey& key : keys_of(imu)) {
    if (key.name == name) {
      *key.number = key.unit * config_double(value, name, key.range);
      return;
    }
    names.push_back(key.name);
  }
  fail_unknown_key(value, name, names);
}

}  // namespace

ImuCalibration ImuDevice::calibration() const {
  const Rigid3 rig_from_imu(so3_exp(turn_rad), lever_m);
  const ImuNoise noise = {gyroscope.noise_density,
                          accelerometer.noise_density,
                          gyroscope.random_walk,
                          accelerometer.random_walk};
  return {rig_from_imu.inverse(), time_shift_s, noise};
}

std::vector<std::string> imu_names() {
  std::vector<std::string> names;
  for (const NamedImu& imu : kImus) names.emplace_back(imu.name);
  return names;
}

ImuDevice parse_imu(const std::vector<std::string>& words) {
  const auto found =
      words.empty() ? kImus.end() : std::ranges::find(kImus, words[0], &NamedImu::name);
  if (found == kImus.end()) {
    throw InputError(kImuOption,
                     fmt::format("begins with {}, expected one of {}",
                                 quote_for_message(words.empty() ? "" : words[0]),
                                 fmt::join(imu_names(), ", ")));
  }
  ImuDevice imu = found->make();
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    ConfigNode value;
    value.kind = ConfigNode::Kind::kScalar;
    value.file = std::make_shared<const std::string>(kImuOption);
    if (equals != std::string::npos) value.scalar = words[i].substr(equals + 1);
    set_number(value, words[i].substr(0, equals), imu);
  }
  return imu;
}

}  // namespace waymark

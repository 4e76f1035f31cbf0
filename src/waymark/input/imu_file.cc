// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Which files the inertial data of a path are in.
#include <algorithm>
#include <iterator>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

ImuTable read_table(const std::filesystem::path& path) {
  return parse_imu_table(read_text_file(path, "a table of inertial data"), path.string());
}

std::string name_of(const std::filesystem::path& path) { return lower_case(path.stem().string()); }

/// A name without what it says of a sensor.
std::string without_sensor(std::string name) {
  for (const std::string_view word :
       {"total", "acceleration", "accelerometer", "accel", "acc", "gyroscope", "gyro"}) {
    const std::size_t at = name.find(word);
    if (at != std::string::npos) name.erase(at, word.size());
  }
  return name;
}

/// The table of the other sensor beside one: its name is the same but for the sensor.
std::filesystem::path find_partner(const std::filesystem::path& path, ImuSensor other) {
  std::vector<std::filesystem::path> partners;
  std::error_code ignored;
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = name_of(entry.path());
    const bool is_partner = entry.path().extension() == path.extension() &&
                            sensor_of_name(name) == other &&
                            without_sensor(name) == without_sensor(name_of(path));
    if (is_partner && entry.is_regular_file(ignored)) partners.push_back(entry.path());
  }
  // The accelerations of Sensor Logger's Accelerometer.csv lack gravity, TotalAcceleration.csv's do
  // not.
  const auto best = std::ranges::max_element(
      partners, {}, [](const auto& partner) { return std::pair(name_of(partner), partner); });
  if (best != partners.end()) return *best;
  throw InputError(path.string(),
                   "is of one sensor, expected that of the other beside it, as Gyroscope.csv and "
                   "Accelerometer.csv are");
}

}  // namespace

ImuStream read_imu_file(const std::filesystem::path& path) {
  ImuTable table = read_table(path);
  std::string source = path.string();
  if (table.accelerometer.empty() || table.gyroscope.empty()) {
    const bool is_turn = table.accelerometer.empty();
    const auto partner =
        find_partner(path, is_turn ? ImuSensor::kAccelerometer : ImuSensor::kGyroscope);
    ImuTable other = read_table(partner);
    source += " and " + partner.string();
    (is_turn ? table.accelerometer : table.gyroscope) =
        std::move(is_turn ? other.accelerometer : other.gyroscope);
    std::ranges::move(other.notes, std::back_inserter(table.notes));
    if (table.fault.empty()) table.fault = std::move(other.fault);
  }
  ImuStream stream = merge_imu(table.gyroscope, std::move(table.accelerometer), source);
  stream.fault = std::move(table.fault);
  std::ranges::move(table.notes, std::back_inserter(stream.notes));
  std::ranges::sort(stream.notes);
  stream.notes.erase(std::unique(stream.notes.begin(), stream.notes.end()), stream.notes.end());
  return stream;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Which files the inertial data of a path are in.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_columns.h"
#include "waymark/input/imu_csv.h"

namespace waymark {
namespace {

constexpr std::string_view kExpectedTable = "a table of inertial data";

/// In order of preference: the accelerations of Sensor Logger's Accelerometer.csv lack gravity.
constexpr std::array<std::string_view, 5> kAccelerometerWords = {
    "totalacceleration", "accelerometer", "acceleration", "accel", "acc"};
constexpr std::array<std::string_view, 2> kGyroscopeWords = {"gyroscope", "gyro"};

ImuTable read_table(const std::filesystem::path& path) {
  return parse_imu_table(read_text_file(path, kExpectedTable), path.string());
}

/// The rest of the name of a file with one of the words in it, and the word's place in the list.
template <std::size_t kCount>
std::optional<std::pair<std::size_t, std::string>> without_word(
    const std::filesystem::path& path, const std::array<std::string_view, kCount>& words) {
  std::string stem = lower_case(path.stem().string());
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::size_t at = stem.find(words[i]);
    if (at != std::string::npos) return std::pair(i, stem.erase(at, words[i].size()));
  }
  return std::nullopt;
}

std::vector<std::filesystem::path> tables_in(const std::filesystem::path& folder) {
  constexpr std::size_t kMaxFiles = 10000;
  std::vector<std::filesystem::path> tables;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string extension = lower_case(entry.path().extension().string());
    const bool is_table = extension == ".csv" || extension == ".txt";
    if (is_table && entry.is_regular_file()) tables.push_back(entry.path());
    if (tables.size() == kMaxFiles) break;
  }
  std::ranges::sort(tables);
  return tables;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : ".";
}

/// The table of the other sensor beside one: its name is the same but for the sensor.
template <class Own, class Other>
std::filesystem::path find_partner(const std::filesystem::path& path,
                                   const Own& own_words,
                                   const Other& other_words) {
  const auto own = without_word(path, own_words);
  std::optional<std::pair<std::size_t, std::filesystem::path>> best;
  for (const std::filesystem::path& other : tables_in(folder_of(path))) {
    const auto rest = without_word(other, other_words);
    if (!own || !rest || rest->second != own->second || other == path) continue;
    if (!best || rest->first < best->first) best = std::pair(rest->first, other);
  }
  if (best) return best->second;
  throw InputError(path.string(),
                   "is of one sensor, expected that of the other beside it, as Gyroscope.csv and "
                   "Accelerometer.csv are");
}

ImuStream stream_of(const std::filesystem::path& path, ImuTable table) {
  ImuStream stream;
  stream.source = path.string();
  std::filesystem::path partner;
  if (table.accelerometer.empty()) {
    partner = find_partner(path, kGyroscopeWords, kAccelerometerWords);
    ImuTable other = read_table(partner);
    table.accelerometer = std::move(other.accelerometer);
    std::ranges::move(other.notes, std::back_inserter(table.notes));
  } else if (table.gyroscope.empty()) {
    partner = find_partner(path, kAccelerometerWords, kGyroscopeWords);
    ImuTable other = read_table(partner);
    table.gyroscope = std::move(other.gyroscope);
    std::ranges::move(other.notes, std::back_inserter(table.notes));
  }
  if (!partner.empty()) stream.source += " and " + partner.string();
  const auto is_at_once = [](const SensorReading& a, const SensorReading& b) {
    return a.timestamp_ns == b.timestamp_ns;
  };
  const bool are_at_once = std::ranges::equal(table.gyroscope, table.accelerometer, is_at_once);
  if (are_at_once) {
    for (std::size_t i = 0; i < table.gyroscope.size(); ++i) {
      const SensorReading& turn = table.gyroscope[i];
      stream.samples.push_back({turn.timestamp_ns, turn.value, table.accelerometer[i].value});
    }
  } else {
    stream.samples = merge_imu(table.gyroscope, std::move(table.accelerometer));
    table.notes.push_back("acceleration interpolated at the times of the gyroscope");
  }
  stream.notes = std::move(table.notes);
  std::ranges::sort(stream.notes);
  stream.notes.erase(std::unique(stream.notes.begin(), stream.notes.end()), stream.notes.end());
  sort_samples(stream);
  return stream;
}

std::filesystem::path table_in(const std::filesystem::path& folder) {
  for (const char* name : {"imu0/data.csv", "mav0/imu0/data.csv", "data.csv"}) {
    if (std::filesystem::is_regular_file(folder / name)) return folder / name;
  }
  std::vector<std::filesystem::path> tables = tables_in(folder);
  for (const bool is_of_both : {true, false}) {
    for (const std::filesystem::path& table : tables) {
      const std::string name = lower_case(table.stem().string());
      const bool is_turn = name.find("gyr") != std::string::npos;
      const bool is_imu = name.find("imu") != std::string::npos;
      const bool is_single = sensor_of_word(name) == ImuSensor::kGyroscope;
      if (is_of_both ? is_imu || (is_turn && name.find("acc") != std::string::npos) : is_single) {
        return table;
      }
    }
  }
  throw InputError(folder.string(),
                   "holds no inertial data by the names of its files, expected imu.csv, "
                   "Gyroscope.csv with TotalAcceleration.csv or Accelerometer.csv, or the like");
}

}  // namespace

ImuStream read_imu_file(const std::filesystem::path& path) {
  try {
    const auto table = std::filesystem::is_directory(path) ? table_in(path) : path;
    return stream_of(table, read_table(table));
  } catch (const std::filesystem::filesystem_error& error) {
    throw InputError(path.string(),
                     "cannot be read: " + error.code().message() + ", expected the right to");
  }
}

}  // namespace waymark

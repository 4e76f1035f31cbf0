// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/input/imu_stream.h"

namespace waymark {

/// Which of the sensors of an IMU.
enum class ImuSensor { kGyroscope, kAccelerometer };

/// Which sensor a name of columns or of a file is of, "w_RS_S_", "gF", "VID_1_gyro"; nothing:
/// another, or both.
std::optional<ImuSensor> sensor_of_name(std::string_view name);

/// A text in lower case letters, of ASCII.
std::string lower_case(std::string_view text);

/// A table of inertial data, in SI units and in the order of its rows.
struct ImuTable {
  std::vector<SensorReading> gyroscope;      ///< rad/s; empty: the table has none.
  std::vector<SensorReading> accelerometer;  ///< m/s^2; the same.
  std::vector<std::string> notes;            ///< Units as understood, for people.
};

/// Parses a table with a row per moment, with or without a header. Times are in the unit with 10 to
/// 5000 rows a second; turns in that of the header, else rad/s unless they are too fast for that;
/// whether accelerations are in m/s^2 or g tells their middle length, gravity's. A last row that is
/// cut off is left out. name: of the file, for errors and for what plain x, y and z are of. Throws
/// InputError.
ImuTable parse_imu_table(std::string_view text, const std::string& name);

/// Reads a table of an IMU; one of a single sensor with that of the other beside it, which has the
/// same name but for the sensor; or a folder that holds such tables, or imu0/data.csv. Throws
/// InputError.
ImuStream read_imu_file(const std::filesystem::path& path);

}  // namespace waymark

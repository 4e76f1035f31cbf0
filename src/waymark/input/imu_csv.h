// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/input/imu_merge.h"
#include "waymark/input/imu_stream.h"

namespace waymark {

/// A table of inertial data, in SI units and in the order of its rows.
struct ImuTable {
  std::vector<SensorReading> gyroscope;      ///< rad/s; empty: the table has none.
  std::vector<SensorReading> accelerometer;  ///< m/s^2; the same.
  std::vector<std::string> notes;            ///< Units as understood, for people.
};

/// Parses a table with a row per moment, or per sensor and moment; with or without a header. Units
/// are those of the header, of times else those with 10 to 5000 rows a second, of turns else rad/s
/// unless they are too fast for that; whether accelerations are in m/s^2 or g tells their middle
/// length, gravity's. A last row that is cut off is left out. name: of the file, for errors and for
/// what plain x, y and z are of. Throws InputError.
ImuTable parse_imu_table(std::string_view text, const std::string& name);

/// Reads a table of an IMU; one of a single sensor with that of the other beside it, which has the
/// same name but for the sensor; or a folder that holds such tables, or imu0/data.csv. Throws
/// InputError.
ImuStream read_imu_file(const std::filesystem::path& path);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// Which of the sensors of an IMU.
enum class ImuSensor { kGyroscope, kAccelerometer };

/// Three columns of a table, those of x, y and z.
struct AxisColumns {
  std::array<std::size_t, 3> columns = {};
  std::string name;  ///< What their names have in common, in lower case: "gf", "w_rs_s_".
  std::string unit;  ///< As the header has it in brackets, in lower case; empty: not.
};

/// What the columns of a table of inertial data hold.
struct ImuColumns {
  char separator = ',';  ///< As of RowReader.
  bool has_header = false;
  std::size_t time = 0;
  std::string time_unit;                    ///< As AxisColumns::unit.
  std::vector<AxisColumns> gyroscopes;      ///< Candidates, in order.
  std::vector<AxisColumns> accelerometers;  ///< The same.
  /// The column with the name of the sensor that a row is of; nothing: rows are of all.
  std::optional<std::size_t> sensor;
};

/// Which sensor a word means, "ACC", "android.sensor.gyroscope"; nothing: another.
std::optional<ImuSensor> sensor_of_word(std::string_view word);

/// A text in lower case letters, of ASCII.
std::string lower_case(std::string_view text);

/// Recognises the columns, by their header, else by the first rows. name: of the file, of which the
/// last part says what plain x, y and z are of. Throws InputError where there is no time, or no
/// sensor.
ImuColumns find_imu_columns(std::string_view text, const std::string& name);

}  // namespace waymark

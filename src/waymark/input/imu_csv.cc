// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/imu_columns.h"

namespace waymark {
namespace {

constexpr double kStandardGravity = 9.80665;
constexpr std::size_t kNumRowsLooked = 5000;

struct TimeUnit {
  const char* name;
  std::int64_t ns;
};
constexpr std::array<TimeUnit, 4> kTimeUnits = {
    {{"s", 1'000'000'000}, {"ms", 1'000'000}, {"us", 1'000}, {"ns", 1}}};

std::optional<TimeUnit> stated_time_unit(const std::string& unit) {
  if (unit.starts_with("n")) return kTimeUnits[3];
  if (unit.starts_with("us") || unit.starts_with("micro") || unit.starts_with("\xC2\xB5")) {
    return kTimeUnits[2];
  }
  if (unit.starts_with("ms") || unit.starts_with("milli")) return kTimeUnits[1];
  if (unit.starts_with("s")) return kTimeUnits[0];
  return std::nullopt;
}

/// By the steps: no unit but one makes 10 to 5000 rows a second of them.
TimeUnit find_time_unit(std::string_view text, const std::string& name, const ImuColumns& columns) {
  if (const auto stated = stated_time_unit(columns.time_unit)) return *stated;
  std::vector<double> times, steps;
  RowReader rows(text, name, columns.separator);
  while (times.size() < kNumRowsLooked && rows.next()) {
    if (columns.time >= rows.fields().size()) continue;
    const std::optional<double> time = parse_number(rows.fields()[columns.time]);
    if (time) times.push_back(*time);
  }
  std::ranges::sort(times);  // Rows of two sensors need not be in order.
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
  }
  const double step = steps.empty() ? 0.0 : median(steps);
  for (const TimeUnit& unit : kTimeUnits) {
    const double step_s = 1e-9 * static_cast<double>(unit.ns) * step;
    if (step_s >= 2e-4 && step_s <= 0.1) return unit;
  }
  throw InputError(name,
                   fmt::format("has times {:g} apart, expected 10 to 5000 rows a second, in s, "
                               "ms, us or ns",
                               step));
}

/// What one sensor measured, in the unit of the table.
class TableReader {
 public:
  TableReader(std::string_view text, const std::string& name)
      : text_(text),
        name_(name),
        columns_(find_imu_columns(text, name)),
        time_unit_(find_time_unit(text, name, columns_)) {}

  const ImuColumns& columns() const { return columns_; }
  const char* time_unit() const { return time_unit_.name; }

  std::vector<SensorReading> read(const AxisColumns& axes,
                                  ImuSensor sensor,
                                  std::size_t max_readings = SIZE_MAX) const {
    std::vector<SensorReading> readings;
    RowReader rows(text_, name_, columns_.separator);
    if (columns_.has_header && !text_.starts_with('#')) rows.next();
    std::optional<InputError> fault;
    while (readings.size() < max_readings && rows.next()) {
      // Of the last row it is no fault: recorders are switched off.
      if (fault) throw InputError(*fault);
      try {
        read_row(rows, axes, sensor, readings);
      } catch (const InputError& error) {
        fault = error;
      }
      if (readings.size() <= kMaxImuSamples) continue;
      throw InputError(rows.where(),
                       fmt::format("one row too many, expected at most {}", kMaxImuSamples));
    }
    if (fault && readings.empty()) throw InputError(*fault);
    return readings;
  }

 private:
  void read_row(const RowReader& rows,
                const AxisColumns& axes,
                ImuSensor sensor,
                std::vector<SensorReading>& readings) const {
    const std::vector<std::string_view>& fields = rows.fields();
    const std::size_t last =
        std::max({std::ranges::max(axes.columns), columns_.time, columns_.sensor.value_or(0)});
    if (columns_.sensor && *columns_.sensor < fields.size() &&
        sensor_of_word(fields[*columns_.sensor]) != sensor) {
      return;
    }
    rows.expect_at_least(last + 1, "a time and x, y and z");
    const auto is_missing = [&](std::size_t i) {
      const std::string word = lower_case(fields[i]);
      return word.empty() || word == "nan" || word == "null";
    };
    if (std::ranges::all_of(axes.columns, is_missing)) return;
    const auto time_ns = parse_time(fields[columns_.time], time_unit_.ns);
    if (!time_ns || *time_ns < 0) {
      throw InputError(rows.where(),
                       fmt::format("field {} is {}, expected a time in {} from 0 on",
                                   columns_.time + 1,
                                   quote_for_message(fields[columns_.time]),
                                   time_unit_.name));
    }
    SensorReading& reading = readings.emplace_back();
    reading.timestamp_ns = *time_ns;
    for (int i = 0; i < 3; ++i) {
      reading.value[i] = rows.number(axes.columns[static_cast<std::size_t>(i)]);
    }
  }

  std::string_view text_;
  const std::string& name_;
  ImuColumns columns_;
  TimeUnit time_unit_;
};

double median_length(const std::vector<SensorReading>& readings) {
  std::vector<double> lengths;
  for (const SensorReading& reading : readings) lengths.push_back(reading.value.norm());
  return lengths.empty() ? 0.0 : median(lengths);
}

/// m/s^2 of the unit in which the middle length of accelerations is gravity's; nothing if it is
/// not. Of two devices mixed in a table a part of them need have it.
std::optional<double> gravity_unit(const std::vector<SensorReading>& readings) {
  constexpr std::size_t kLeastPart = 5;
  const double length = median_length(readings);
  const auto is_gravity = [](double metres) { return metres > 7.0 && metres < 13.0; };
  const auto num_alike = std::ranges::count_if(
      readings, [&](const SensorReading& reading) { return is_gravity(reading.value.norm()); });
  const bool are_some = static_cast<std::size_t>(num_alike) * kLeastPart > readings.size();
  if (is_gravity(length) || are_some) return 1.0;
  if (length > 0.7 && length < 1.3) return kStandardGravity;
  return std::nullopt;
}

void scale(std::vector<SensorReading>& readings, double factor) {
  for (SensorReading& reading : readings) reading.value *= factor;
}

/// The columns whose length is that of gravity; nothing where there is no accelerometer.
const AxisColumns* take_accelerometer(const TableReader& reader,
                                      const std::string& name,
                                      ImuTable& table) {
  double first_length = -1.0;
  for (const AxisColumns& axes : reader.columns().accelerometers) {
    const auto some = reader.read(axes, ImuSensor::kAccelerometer, kNumRowsLooked);
    const double length = median_length(some);
    if (first_length < 0.0) first_length = length;
    const std::optional<double> unit = gravity_unit(some);
    if (!unit) continue;
    table.accelerometer = reader.read(axes, ImuSensor::kAccelerometer);
    // Of Apple's Core Motion: -1 g along an axis that points up.
    const bool is_negated = axes.name.starts_with("accelerometeracceleration");
    scale(table.accelerometer, is_negated ? -*unit : *unit);
    table.notes.push_back(
        fmt::format("acceleration in {}, as gravity in it tells (its middle length is {:.3f}){}",
                    *unit == 1.0 ? "m/s^2" : "g",
                    length,
                    is_negated ? "; turned about, as it is that of Core Motion" : ""));
    return &axes;
  }
  if (first_length < 0.0) return nullptr;
  throw InputError(name,
                   fmt::format("has accelerations of a middle length of {:.3g}, expected gravity "
                               "in them, 9.8 m/s^2 or 1 g",
                               first_length));
}

void take_gyroscope(const TableReader& reader, const AxisColumns& axes, ImuTable& table) {
  table.gyroscope = reader.read(axes, ImuSensor::kGyroscope);
  const bool is_in_degrees = axes.unit.find("deg") != std::string::npos || axes.unit == "dps" ||
                             axes.unit.starts_with("\xC2\xB0");
  const bool is_stated = is_in_degrees || axes.unit.find("rad") != std::string::npos;
  // No such sensor of a phone or drone measures 2000 degrees a second and more.
  constexpr double kMaxRadians = 35.0;
  constexpr double kMaxUsualRadians = 4.0;
  double longest = 0.0;
  for (const SensorReading& reading : table.gyroscope) {
    longest = std::max(longest, reading.value.norm());
  }
  const bool looks_like_degrees =
      longest > kMaxRadians || median_length(table.gyroscope) > kMaxUsualRadians;
  const bool is_degrees = is_stated ? is_in_degrees : looks_like_degrees;
  if (is_degrees) scale(table.gyroscope, std::numbers::pi / 180.0);
  table.notes.push_back(fmt::format("angular velocity in {}, as {}",
                                    is_degrees ? "deg/s" : "rad/s",
                                    is_stated ? "the header says" : "its size tells"));
}

}  // namespace

ImuTable parse_imu_table(std::string_view text, const std::string& name) {
  const TableReader reader(text, name);
  ImuTable table;
  table.notes.push_back(fmt::format("times in {}", reader.time_unit()));
  const AxisColumns* const accelerometer = take_accelerometer(reader, name, table);
  for (const AxisColumns& axes : reader.columns().gyroscopes) {
    const bool is_other = !accelerometer || accelerometer->columns != axes.columns;
    if (!is_other && !reader.columns().sensor) continue;
    take_gyroscope(reader, axes, table);
    break;
  }
  return table;
}

}  // namespace waymark

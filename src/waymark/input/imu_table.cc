// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxColumns = 1000;
constexpr std::size_t kNumRowsLooked = 5000;
constexpr std::size_t kNoColumn = SIZE_MAX;
constexpr const char* kExpectedColumns =
    "expected columns of a time and of x, y and z of a gyroscope, an accelerometer or both";

using Rows = std::vector<std::vector<std::string_view>>;

/// Three columns of a table, those of x, y and z.
struct AxisColumns {
  std::array<std::size_t, 3> columns = {kNoColumn, kNoColumn, kNoColumn};
  std::string name;  ///< What their names have in common, in lower case.
  std::string unit;  ///< As the header has it in brackets, in lower case; empty: not.
};

bool has_word(std::string_view text, std::string_view word) {
  return text.find(word) != std::string_view::npos;
}

bool is_number(std::string_view field) { return parse_number(field).has_value(); }

double median_length(const std::vector<SensorReading>& readings) {
  std::vector<double> lengths;
  for (const SensorReading& reading : readings) lengths.push_back(reading.value.norm());
  return lengths.empty() ? 0.0 : median(lengths);
}

void scale(std::vector<SensorReading>& readings, double factor) {
  for (SensorReading& reading : readings) reading.value *= factor;
}

/// What the columns of a table hold, by its header, else by its first rows.
class TableReader {
 public:
  TableReader(std::string_view text, const std::string& name) : text_(text), name_(name) {
    constexpr std::string_view kMark = "\xEF\xBB\xBF";
    if (text_.starts_with(kMark)) text_.remove_prefix(kMark.size());
    text_.remove_prefix(std::min(text_.find_first_not_of(" \t\r\n#"), text_.size()));
    const std::string_view line = text_.substr(0, text_.find_first_of("\r\n"));
    for (const char separator : {'\t', ';', ','}) {
      if (std::ranges::count(line, separator) >= 2) separator_ = separator;
    }
    RowReader reader(text_, name, separator_);
    if (!reader.next()) throw InputError(name, std::string("empty, ") + kExpectedColumns);
    header_ = reader.fields();
    has_header_ = 2 * std::ranges::count_if(header_, is_number) < std::ssize(header_);
    if (!has_header_) reader = RowReader(text_, name, separator_);
    Rows rows;
    while (rows.size() < kNumRowsLooked && reader.next()) rows.push_back(reader.fields());
    if (rows.empty()) throw InputError(name, std::string("has no rows, ") + kExpectedColumns);
    if (header_.size() < 4 || header_.size() > kMaxColumns) {
      throw InputError(name, "has " + count_of(header_.size(), "column") + ", " + kExpectedColumns);
    }
    has_header_ ? take_header(rows.front()) : take_bare_columns(rows);
    if (gyroscopes.empty() && accelerometers.empty()) {
      throw InputError(name, std::string("names no sensor, ") + kExpectedColumns);
    }
    find_time_unit(rows);
  }

  std::vector<SensorReading> read(const AxisColumns& axes, std::size_t max_rows = SIZE_MAX) const {
    std::vector<SensorReading> readings;
    RowReader rows(text_, name_, separator_);
    if (has_header_) rows.next();
    std::optional<InputError> fault;
    while (readings.size() < max_rows && rows.next()) {
      // Of the last row it is no fault: recorders are switched off.
      if (fault) throw InputError(*fault);
      try {
        read_row(rows, axes, readings);
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

  std::vector<AxisColumns> gyroscopes;      ///< Candidates, in order.
  std::vector<AxisColumns> accelerometers;  ///< The same.
  const char* time_unit = "";

 private:
  void add(const AxisColumns& axes, std::optional<ImuSensor> sensor) {
    if (sensor == ImuSensor::kGyroscope) gyroscopes.push_back(axes);
    if (sensor == ImuSensor::kAccelerometer) accelerometers.push_back(axes);
  }

  std::optional<ImuSensor> sensor_of_file() const {
    return sensor_of_name(std::filesystem::path(name_).stem().string());
  }

  void take_header(const std::vector<std::string_view>& row) {
    std::vector<AxisColumns> triples;
    time_ = kNoColumn;
    for (std::size_t i = 0; i < header_.size(); ++i) {
      std::string name = lower_case(header_[i]);
      std::erase_if(name, [](char c) { return c == '"' || c == '\'' || c == ' '; });
      const std::size_t open = std::min(name.find_first_of("[("), name.size());
      const std::string unit = name.substr(open);
      name.resize(name.find_last_not_of('_', open - 1) + 1);
      if (name.empty()) continue;
      if (has_word(name, "time") || name == "t" || name == "seconds_elapsed") {
        if (time_ == kNoColumn && i < row.size() && is_number(row[i])) time_ = i;
        continue;
      }
      const auto axis = static_cast<std::size_t>(name.back() - 'x');
      if (axis > 2) continue;
      name.pop_back();
      auto triple = std::ranges::find(triples, name, &AxisColumns::name);
      if (triple == triples.end()) triple = triples.insert(triple, {.name = name, .unit = unit});
      triple->columns[axis] = i;
    }
    if (time_ == kNoColumn) {
      throw InputError(name_, std::string("names no time, ") + kExpectedColumns);
    }
    for (const AxisColumns& triple : triples) {
      if (std::ranges::count(triple.columns, kNoColumn) > 0) continue;
      add(triple, triple.name.empty() ? sensor_of_file() : sensor_of_name(triple.name));
    }
  }

  /// Rows "time, gyroscope, accelerometer" as in EuRoC, "time, x, y, z" or "x, y, z, time".
  void take_bare_columns(const Rows& rows) {
    const auto rises = [&](std::size_t column) {
      double last = -1.0;
      for (const auto& row : rows) {
        const auto value = column < row.size() ? parse_number(row[column]) : std::nullopt;
        if (!value || *value < last) return false;
        last = *value;
      }
      return last > parse_number(rows.front()[column]).value_or(last);
    };
    time_ = 0;
    while (time_ < header_.size() && !rises(time_)) ++time_;
    if (time_ == header_.size()) {
      throw InputError(name_, std::string("has no column that rises, ") + kExpectedColumns);
    }
    const auto axes_from = [&](std::size_t first) {
      AxisColumns axes;
      for (std::size_t i = 0; i < 3; ++i) axes.columns[i] = first + i + (first + i >= time_);
      return axes;
    };
    if (header_.size() < 7) return add(axes_from(0), sensor_of_file());
    // The one with a length of gravity is the accelerometer.
    gyroscopes = {axes_from(0), axes_from(3)};
    accelerometers = {axes_from(3), axes_from(0)};
  }

  /// By the steps: no unit but one makes 10 to 5000 rows a second of them.
  void find_time_unit(const Rows& rows) {
    std::vector<double> times, steps;
    for (const auto& row : rows) {
      const auto time = time_ < row.size() ? parse_number(row[time_]) : std::nullopt;
      if (time) times.push_back(*time);
    }
    std::ranges::sort(times);
    for (std::size_t i = 1; i < times.size(); ++i) {
      if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
    }
    const double step = steps.empty() ? 0.0 : median(steps);
    time_unit_ns_ = 1'000'000'000;
    for (const char* unit : {"s", "ms", "us", "ns"}) {
      const double step_s = 1e-9 * static_cast<double>(time_unit_ns_) * step;
      time_unit = unit;
      if (step_s >= 2e-4 && step_s <= 0.1) return;
      time_unit_ns_ /= 1000;
    }
    throw InputError(name_,
                     fmt::format("has times {:g} apart, expected 10 to 5000 rows a second, in s, "
                                 "ms, us or ns",
                                 step));
  }

  void read_row(const RowReader& rows,
                const AxisColumns& axes,
                std::vector<SensorReading>& readings) const {
    const std::vector<std::string_view>& fields = rows.fields();
    rows.expect_at_least(std::max(std::ranges::max(axes.columns), time_) + 1,
                         "a time and x, y and z");
    const auto is_missing = [&](std::size_t i) {
      const std::string word = lower_case(fields[i]);
      return word.empty() || word == "nan" || word == "null";
    };
    if (std::ranges::all_of(axes.columns, is_missing)) return;
    const auto time_ns = parse_time(fields[time_], time_unit_ns_);
    if (!time_ns || *time_ns < 0) {
      throw InputError(rows.where(),
                       fmt::format("field {} is {}, expected a time in {} from 0 on",
                                   time_ + 1,
                                   quote_for_message(fields[time_]),
                                   time_unit));
    }
    const auto& [x, y, z] = axes.columns;
    readings.push_back({*time_ns, {rows.number(x), rows.number(y), rows.number(z)}});
  }

  std::string_view text_;
  const std::string& name_;
  std::vector<std::string_view> header_;  ///< The first row, whatever it is.
  char separator_ = ' ';
  bool has_header_ = false;
  std::size_t time_ = 0;
  std::int64_t time_unit_ns_ = 1;
};

/// The columns whose length is that of gravity; nothing where there is no accelerometer.
const AxisColumns* take_accelerometer(const TableReader& reader,
                                      const std::string& name,
                                      ImuTable& table) {
  if (reader.accelerometers.empty()) return nullptr;
  double length = 0.0;
  for (const AxisColumns& axes : reader.accelerometers) {
    length = median_length(reader.read(axes, kNumRowsLooked));
    const bool is_metric = length > 7.0 && length < 13.0;
    if (!is_metric && !(length > 0.7 && length < 1.3)) continue;
    table.accelerometer = reader.read(axes);
    // Of Apple's Core Motion: -1 g along an axis that points up.
    const bool is_negated = axes.name.starts_with("accelerometeracceleration");
    scale(table.accelerometer, (is_metric ? 1.0 : kStandardGravity) * (is_negated ? -1.0 : 1.0));
    table.notes.push_back(
        fmt::format("acceleration in {}, as gravity in it tells (its middle length is {:.3f}){}",
                    is_metric ? "m/s^2" : "g",
                    length,
                    is_negated ? "; turned about, as it is that of Core Motion" : ""));
    return &axes;
  }
  table.accelerometer = reader.read(reader.accelerometers.back());
  table.fault = fmt::format(
      "{}: has accelerations of a middle length of {:.3g}, expected gravity in them, 9.8 m/s^2 or "
      "1 g",
      name,
      length);
  return &reader.accelerometers.back();
}

void take_gyroscope(const TableReader& reader, const AxisColumns& axes, ImuTable& table) {
  table.gyroscope = reader.read(axes);
  const bool says_degrees =
      has_word(axes.unit, "deg") || has_word(axes.unit, "dps") || has_word(axes.unit, "\xC2\xB0");
  const bool is_stated = says_degrees || has_word(axes.unit, "rad");
  // No such sensor of a phone or drone measures 2000 degrees a second and more.
  constexpr double kMaxRadians = 35.0;
  constexpr double kMaxUsualRadians = 4.0;
  const bool looks_like_degrees = median_length(table.gyroscope) > kMaxUsualRadians ||
                                  std::ranges::any_of(table.gyroscope, [](const auto& reading) {
                                    return reading.value.norm() > kMaxRadians;
                                  });
  const bool is_degrees = is_stated ? says_degrees : looks_like_degrees;
  if (is_degrees) scale(table.gyroscope, std::numbers::pi / 180.0);
  table.notes.push_back(fmt::format("angular velocity in {}, as {}",
                                    is_degrees ? "deg/s" : "rad/s",
                                    is_stated ? "the header says" : "its size tells"));
}

}  // namespace

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::optional<ImuSensor> sensor_of_name(std::string_view name) {
  std::string letters = lower_case(name);
  std::erase_if(letters, [](char c) { return c < 'a' || c > 'z'; });
  const bool is_turn = letters == "w" || letters == "g" || letters == "omega" ||
                       letters.starts_with("wrs") || has_word(letters, "gyr") ||
                       has_word(letters, "angular") || has_word(letters, "rotationrate");
  const bool is_push =
      letters == "a" || letters == "gf" || letters.starts_with("ars") || has_word(letters, "acc");
  if (is_turn == is_push) return std::nullopt;
  return is_turn ? ImuSensor::kGyroscope : ImuSensor::kAccelerometer;
}

ImuTable parse_imu_table(std::string_view text, const std::string& name) {
  const TableReader reader(text, name);
  ImuTable table;
  table.notes.push_back(fmt::format("times in {}", reader.time_unit));
  const AxisColumns* const accelerometer = take_accelerometer(reader, name, table);
  for (const AxisColumns& axes : reader.gyroscopes) {
    if (accelerometer && accelerometer->columns == axes.columns) continue;
    take_gyroscope(reader, axes, table);
    break;
  }
  return table;
}

}  // namespace waymark

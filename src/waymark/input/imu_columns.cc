// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_columns.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxColumns = 1000;
using Rows = std::vector<std::vector<std::string_view>>;

constexpr const char* kExpectedColumns =
    "columns of a time and of x, y and z of a gyroscope, an accelerometer or both";

bool has_word(std::string_view text, std::string_view word) {
  return text.find(word) != std::string_view::npos;
}

/// The first line that is not blank, without what marks it as a comment.
std::string_view first_line(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n#"), text.size()));
  return text.substr(0, text.find_first_of("\r\n"));
}

char separator_of(std::string_view line) {
  for (const char separator : {',', ';', '\t'}) {
    if (std::ranges::count(line, separator) >= 2) return separator;
  }
  return ' ';
}

Rows first_rows(std::string_view text, const std::string& name, char separator, bool has_header) {
  constexpr std::size_t kNumLooked = 1000;
  Rows rows;
  RowReader reader(text, name, separator);
  const bool is_comment = text.starts_with('#');
  if (has_header && !is_comment) reader.next();
  while (rows.size() < kNumLooked && reader.next()) rows.push_back(reader.fields());
  if (rows.empty())
    throw InputError(name, std::string("has no rows, expected ") + kExpectedColumns);
  if (rows.front().size() < 4 || rows.front().size() > kMaxColumns) {
    throw InputError(name,
                     "has " + count_of(rows.front().size(), "column") + ", expected " +
                         std::string(kExpectedColumns));
  }
  return rows;
}

/// The name of a column: what comes before its unit, and that.
struct ColumnName {
  std::string name;
  std::string unit;
};

ColumnName parse_name(std::string_view field) {
  std::string text;
  for (const char c : lower_case(field)) {
    if (c != '"' && c != '\'') text += c;
  }
  ColumnName column;
  if (const std::size_t open = text.find_first_of("[("); open != std::string::npos) {
    column.unit = text.substr(open + 1, text.find_first_of("])", open) - open - 1);
    text.resize(open);
  }
  text.resize(text.find_last_not_of(" _") + 1);
  column.name = text.substr(std::min(text.find_first_not_of(' '), text.size()));
  return column;
}

/// Which sensor the columns of that name are of, without the letter of the axis.
std::optional<ImuSensor> sensor_of_columns(const std::string& name) {
  std::string letters;
  for (const char c : name) {
    if (c >= 'a' && c <= 'z') letters += c;
  }
  if (has_word(letters, "gravity") || has_word(letters, "mag")) return std::nullopt;
  const bool is_turn = letters == "w" || letters == "g" || letters == "omega" ||
                       letters.starts_with("wrs") || has_word(letters, "angular") ||
                       has_word(letters, "rotationrate");
  if (is_turn) return ImuSensor::kGyroscope;
  if (letters == "a" || letters == "gf" || letters.starts_with("ars")) {
    return ImuSensor::kAccelerometer;
  }
  return sensor_of_word(letters);
}

bool is_numeric(const Rows& rows, std::size_t column) {
  return column < rows.front().size() && parse_number(rows.front()[column]).has_value();
}

void take_header(std::string_view line,
                 const std::string& name,
                 const Rows& rows,
                 ImuColumns& found) {
  RowReader reader(line, name, found.separator);
  reader.next();
  const std::optional<ImuSensor> of_file =
      sensor_of_word(std::filesystem::path(name).filename().string());
  std::vector<AxisColumns> triples;
  bool has_time = false;
  for (std::size_t i = 0; i < std::min(reader.fields().size(), kMaxColumns); ++i) {
    const ColumnName column = parse_name(reader.fields()[i]);
    const bool is_time =
        has_word(column.name, "time") || column.name == "t" || column.name == "seconds_elapsed";
    if (is_time && !has_time && is_numeric(rows, i)) {
      has_time = true;
      found.time = i;
      found.time_unit = column.unit;
    }
    if (is_time || column.name.empty()) continue;
    const auto axis = static_cast<std::size_t>(column.name.back() - 'x');
    if (axis > 2) continue;
    const std::string base = column.name.substr(0, column.name.size() - 1);
    auto triple = std::ranges::find(triples, base, &AxisColumns::name);
    constexpr std::size_t kNone = SIZE_MAX;
    if (triple == triples.end()) {
      triple = triples.insert(triples.end(), {{kNone, kNone, kNone}, base, column.unit});
    }
    triple->columns[axis] = i;
  }
  if (!has_time) throw InputError(name, std::string("names no time, expected ") + kExpectedColumns);
  for (const AxisColumns& triple : triples) {
    if (std::ranges::count(triple.columns, SIZE_MAX) > 0) continue;
    const bool is_plain = triple.name.empty();
    if (found.sensor && is_plain) found.gyroscopes = found.accelerometers = {triple};
    const auto sensor = is_plain ? of_file : sensor_of_columns(triple.name);
    if (found.sensor || !sensor) continue;
    (*sensor == ImuSensor::kGyroscope ? found.gyroscopes : found.accelerometers).push_back(triple);
  }
}

/// Whether a column never falls, and rises.
bool is_time(const Rows& rows, std::size_t column) {
  double first = 0.0;
  double last = -1.0;
  for (const auto& row : rows) {
    const auto value = column < row.size() ? parse_number(row[column]) : std::nullopt;
    if (!value || *value < last) return false;
    if (last < 0.0) first = *value;
    last = *value;
  }
  return last > first;
}

/// Rows "time, gyroscope, accelerometer" as in EuRoC, "time, x, y, z" or "x, y, z, time".
void take_bare_columns(const std::string& name, const Rows& rows, ImuColumns& found) {
  const std::size_t num_columns = rows.front().size();
  std::vector<std::size_t> columns(num_columns);
  std::iota(columns.begin(), columns.end(), std::size_t{0});
  if (found.sensor) std::erase(columns, *found.sensor);
  const auto time = std::ranges::find_if(columns, [&](std::size_t i) { return is_time(rows, i); });
  if (time == columns.end()) {
    throw InputError(name, std::string("has no column that rises, expected ") + kExpectedColumns);
  }
  found.time = *time;
  columns.erase(time);
  const auto triple = [&](std::size_t first) {
    return AxisColumns{{columns[first], columns[first + 1], columns[first + 2]}, {}, {}};
  };
  const auto of_file = sensor_of_word(std::filesystem::path(name).filename().string());
  if (columns.size() >= 6 && !found.sensor) {
    // The one with a length of gravity is the accelerometer.
    found.gyroscopes = {triple(0), triple(3)};
    found.accelerometers = {triple(3), triple(0)};
  } else if (columns.size() >= 3) {
    if (found.sensor || of_file == ImuSensor::kGyroscope) found.gyroscopes = {triple(0)};
    if (found.sensor || of_file == ImuSensor::kAccelerometer) found.accelerometers = {triple(0)};
  }
}

/// The column of words of which some mean a gyroscope and some an accelerometer.
std::optional<std::size_t> find_sensor_column(const Rows& rows) {
  for (std::size_t i = 0; i < rows.front().size(); ++i) {
    if (is_numeric(rows, i)) continue;
    const auto has = [&](ImuSensor sensor) {
      return std::ranges::any_of(rows, [&](const auto& row) {
        return i < row.size() && sensor_of_word(row[i]) == sensor;
      });
    };
    if (has(ImuSensor::kGyroscope) && has(ImuSensor::kAccelerometer)) return i;
  }
  return std::nullopt;
}

}  // namespace

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::optional<ImuSensor> sensor_of_word(std::string_view word) {
  const std::string lower = lower_case(word);
  if (has_word(lower, "uncalib")) return std::nullopt;
  const bool is_turn = has_word(lower, "gyr");
  const bool is_push = has_word(lower, "acc");
  if (is_turn == is_push) return std::nullopt;
  return is_turn ? ImuSensor::kGyroscope : ImuSensor::kAccelerometer;
}

ImuColumns find_imu_columns(std::string_view text, const std::string& name) {
  const std::string_view line = first_line(text);
  ImuColumns found;
  found.separator = separator_of(line);
  RowReader reader(line, name, found.separator);
  if (!reader.next()) throw InputError(name, std::string("empty, expected ") + kExpectedColumns);
  const auto num_numbers = std::ranges::count_if(
      reader.fields(), [](auto field) { return parse_number(field).has_value(); });
  found.has_header = 2 * num_numbers < static_cast<std::ptrdiff_t>(reader.fields().size());
  const Rows rows = first_rows(text, name, found.separator, found.has_header);
  found.sensor = find_sensor_column(rows);
  if (found.has_header) {
    take_header(line, name, rows, found);
  } else {
    take_bare_columns(name, rows, found);
  }
  if (!found.gyroscopes.empty() || !found.accelerometers.empty()) return found;
  throw InputError(name, std::string("names no sensor, expected ") + kExpectedColumns);
}

}  // namespace waymark

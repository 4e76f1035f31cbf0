// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxColumns = 300;
/// More than two hours at 1 kHz.
constexpr std::size_t kMaxImuSamples = std::size_t{1} << 23;
constexpr std::size_t kNumRowsLooked = 5000;
constexpr std::size_t kNoColumn = SIZE_MAX;

enum class ImuSensor { kGyroscope, kAccelerometer };

using Row = std::vector<std::string_view>;

/// Three columns of a table, those of x, y and z.
struct AxisColumns {
  std::array<std::size_t, 3> columns = {kNoColumn, kNoColumn, kNoColumn};
  std::string name = {};  ///< What their names have in common, in lower case.
  std::string unit = {};  ///< As the header has it in brackets, in lower case; empty: not.
};

bool has_word(std::string_view text, std::string_view word) {
  return text.find(word) != std::string_view::npos;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// In lower case, without the folder and the extension.
std::string name_of(const std::filesystem::path& path) { return lower_case(path.stem().string()); }

/// Which sensor a name of columns or of a file is of, "w_rs_s_", "gf", "vid_1_gyro"; nothing:
/// another, or both.
std::optional<ImuSensor> sensor_of_name(std::string letters) {
  std::erase_if(letters, [](char c) { return c < 'a' || c > 'z'; });
  const bool is_turn = letters == "w" || letters == "g" || letters.starts_with("wrs") ||
                       has_word(letters, "gyr") || has_word(letters, "angular") ||
                       has_word(letters, "rotationrate");
  const bool is_push =
      letters == "a" || letters == "gf" || letters.starts_with("ars") || has_word(letters, "acc");
  if (is_turn == is_push) return std::nullopt;
  return is_turn ? ImuSensor::kGyroscope : ImuSensor::kAccelerometer;
}

bool is_number(std::string_view field) { return parse_number(field).has_value(); }

/// The numbers among the values of a column.
std::vector<double> numbers_in(const std::vector<Row>& rows, std::size_t column) {
  std::vector<double> numbers;
  for (const Row& row : rows) {
    const auto number = column < row.size() ? parse_number(row[column]) : std::nullopt;
    if (number) numbers.push_back(*number);
  }
  return numbers;
}

/// Of the values; of none that of one that is 0.
std::vector<double> lengths_of(const std::vector<SensorReading>& readings) {
  std::vector<double> lengths;
  for (const SensorReading& reading : readings) lengths.push_back(reading.value.norm());
  if (lengths.empty()) lengths.push_back(0.0);
  return lengths;
}

void scale(std::vector<SensorReading>& readings, double factor) {
  for (SensorReading& reading : readings) reading.value *= factor;
}

/// What the columns of a table hold, by its header, else by its first rows.
class TableReader {
 public:
  TableReader(std::string_view text, const std::string& name)
      : text_(text.substr(0, text.rfind('\n') + 1)), name_(name) {
    // A byte order mark, and what EuRoC begins its header with.
    text_.remove_prefix(std::min(text_.find_first_not_of("\xEF\xBB\xBF \t\r\n#"), text_.size()));
    const std::string_view line = text_.substr(0, text_.find('\n'));
    for (const char separator : {'\t', ';', ','}) {
      if (std::ranges::count(line, separator) >= 2) separator_ = separator;
    }
    RowReader reader(text_, name, separator_);
    if (!reader.next()) fail("empty");
    const Row first = reader.fields();
    has_header_ = 2 * std::ranges::count_if(first, is_number) < std::ssize(first);
    std::vector<Row> rows;
    if (!has_header_) rows.push_back(first);
    while (rows.size() < kNumRowsLooked && reader.next()) rows.push_back(reader.fields());
    if (rows.empty()) fail("has no rows");
    if (first.size() < 4 || first.size() > kMaxColumns) {
      fail("has " + count_of(first.size(), "column"));
    }
    has_header_ ? take_header(first, rows) : take_bare_columns(rows);
    if (gyroscopes.empty() && accelerometers.empty()) fail("names no sensor");
    find_time_unit(numbers_in(rows, time_));
  }

  std::vector<SensorReading> read(const AxisColumns& axes) const {
    std::vector<SensorReading> readings;
    RowReader rows(text_, name_, separator_);
    if (has_header_) rows.next();
    while (rows.next()) {
      if (const auto reading = read_row(rows, axes)) readings.push_back(*reading);
      if (readings.size() <= kMaxImuSamples) continue;
      throw InputError(rows.where(),
                       fmt::format("one row too many, expected at most {}", kMaxImuSamples));
    }
    return readings;
  }

  std::vector<AxisColumns> gyroscopes;      ///< Candidates, in order.
  std::vector<AxisColumns> accelerometers;  ///< The same.
  const char* time_unit = "";

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(name_,
                     what +
                         ", expected columns of a time and of x, y and z of a gyroscope, an "
                         "accelerometer or both");
  }

  /// Nameless columns are of the sensor in the name of the file.
  void add(const AxisColumns& axes) {
    const auto sensor = sensor_of_name(axes.name.empty() ? name_of(name_) : axes.name);
    if (sensor == ImuSensor::kGyroscope) gyroscopes.push_back(axes);
    if (sensor == ImuSensor::kAccelerometer) accelerometers.push_back(axes);
  }

  void take_header(const Row& header, const std::vector<Row>& rows) {
    std::vector<AxisColumns> triples;
    for (std::size_t i = 0; i < header.size(); ++i) {
      std::string name = lower_case(std::string(header[i]));
      std::erase_if(name, [](char c) { return c == '"' || c == '\'' || c == ' '; });
      const std::size_t open = std::min(name.find_first_of("[("), name.size());
      const std::string unit = name.substr(open);
      name.resize(open);
      if (name.empty()) continue;
      if (has_word(name, "time") || name == "t") {
        if (time_ == kNoColumn && !numbers_in({rows.front()}, i).empty()) time_ = i;
        continue;
      }
      const auto axis = static_cast<std::size_t>(name.back() - 'x');
      if (axis > 2) continue;
      name.pop_back();
      auto triple = std::ranges::find(triples, name, &AxisColumns::name);
      if (triple == triples.end()) triple = triples.insert(triple, {.name = name, .unit = unit});
      triple->columns[axis] = i;
    }
    if (time_ == kNoColumn) fail("names no time");
    for (const AxisColumns& triple : triples) {
      if (std::ranges::count(triple.columns, kNoColumn) == 0) add(triple);
    }
  }

  /// Rows "time, gyroscope, accelerometer" as in EuRoC, "time, x, y, z" or "x, y, z, time".
  void take_bare_columns(const std::vector<Row>& rows) {
    const auto from = [](std::size_t first) { return AxisColumns{{first, first + 1, first + 2}}; };
    const std::vector<double> numbers = numbers_in(rows, 0);
    const bool has_all = rows.front().size() >= 7;
    const bool rises =
        !numbers.empty() && numbers.front() < numbers.back() && std::ranges::is_sorted(numbers);
    const bool begins_with_time = has_all || rises;
    time_ = begins_with_time ? 0 : 3;
    if (!has_all) return add(from(begins_with_time ? 1 : 0));
    // The one with a length of gravity is the accelerometer.
    gyroscopes = {from(1), from(4)};
    accelerometers = {from(4), from(1)};
  }

  /// By the steps: no unit but one makes 10 to 5000 rows a second of them.
  void find_time_unit(std::vector<double> times) {
    std::ranges::sort(times);
    std::vector<double> steps = {0.0};
    for (std::size_t i = 1; i < times.size(); ++i) {
      if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
    }
    const double step = median(std::move(steps));
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

  /// Nothing where none of the three is a number: the row is of another sensor.
  std::optional<SensorReading> read_row(const RowReader& rows, const AxisColumns& axes) const {
    const auto& [x, y, z] = axes.columns;
    rows.expect_at_least(std::max({x, y, z, time_}) + 1, "a time and x, y and z");
    const Row& fields = rows.fields();
    const bool is_missing = !is_number(fields[x]) && !is_number(fields[y]) && !is_number(fields[z]);
    if (is_missing) return std::nullopt;
    const auto time_ns = parse_time(fields[time_], time_unit_ns_);
    if (time_ns && *time_ns >= 0) {
      return SensorReading{*time_ns, {rows.number(x), rows.number(y), rows.number(z)}};
    }
    throw InputError(rows.where(),
                     fmt::format("field {} is {}, expected a time in {} from 0 on",
                                 time_ + 1,
                                 quote_for_message(fields[time_]),
                                 time_unit));
  }

  std::string_view text_;  ///< Without a last row that was cut off.
  const std::string& name_;
  char separator_ = ' ';
  bool has_header_ = false;
  std::size_t time_ = kNoColumn;
  std::int64_t time_unit_ns_ = 1'000'000'000;
};

/// The columns whose length is that of gravity, else the last; nothing where there are none.
const AxisColumns* take_accelerometer(const TableReader& reader, ImuTable& table) {
  const AxisColumns* taken = nullptr;
  for (const AxisColumns& axes : reader.accelerometers) {
    taken = &axes;
    table.accelerometer = reader.read(axes);
    const double length = median(lengths_of(table.accelerometer));
    const bool is_metric = length > 7.0 && length < 13.0;
    if (!is_metric && !(length > 0.7 && length < 1.3)) continue;
    // Of Apple's Core Motion: -1 g along an axis that points up.
    const bool is_negated = axes.name.starts_with("accelerometeracceleration");
    scale(table.accelerometer, (is_metric ? 1.0 : kStandardGravity) * (is_negated ? -1.0 : 1.0));
    table.notes.insert(
        fmt::format("acceleration in {}, as gravity in it tells (its middle length is {:.3f}){}",
                    is_metric ? "m/s^2" : "g",
                    length,
                    is_negated ? "; turned about, as it is that of Core Motion" : ""));
    break;
  }
  return taken;
}

void take_gyroscope(const TableReader& reader, const AxisColumns& axes, ImuTable& table) {
  table.gyroscope = reader.read(axes);
  const bool says_degrees =
      has_word(axes.unit, "deg") || has_word(axes.unit, "dps") || has_word(axes.unit, "\xC2\xB0");
  const bool is_stated = says_degrees || has_word(axes.unit, "rad");
  // Of phones and drones none turns that fast: half of the time, or once.
  auto lengths = lengths_of(table.gyroscope);
  const bool looks_like_degrees = median(lengths) > 4.0 || std::ranges::max(lengths) > 35.0;
  const bool is_degrees = is_stated ? says_degrees : looks_like_degrees;
  if (is_degrees) scale(table.gyroscope, std::numbers::pi / 180.0);
  table.notes.insert(fmt::format("angular velocity in {}, as {}",
                                 is_degrees ? "deg/s" : "rad/s",
                                 is_stated ? "the header says" : "its size tells"));
}

ImuTable read_table(const std::filesystem::path& path) {
  return parse_imu_table(read_text_file(path, "a table of inertial data"), path.string());
}

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
  std::filesystem::path partner;
  std::error_code ignored;
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = name_of(entry.path());
    const bool is_partner = entry.path().extension() == path.extension() &&
                            sensor_of_name(name) == other &&
                            without_sensor(name) == without_sensor(name_of(path));
    // The accelerations of Sensor Logger's Accelerometer.csv lack gravity, TotalAcceleration.csv's
    // do not.
    if (is_partner && entry.is_regular_file(ignored)) partner = std::max(partner, entry.path());
  }
  if (!partner.empty()) return partner;
  throw InputError(path.string(),
                   "is of one sensor, expected that of the other beside it, as Gyroscope.csv and "
                   "Accelerometer.csv are");
}

}  // namespace

ImuTable parse_imu_table(std::string_view text, const std::string& name) {
  const TableReader reader(text, name);
  ImuTable table;
  table.notes.insert(fmt::format("times in {}", reader.time_unit));
  const AxisColumns* const accelerometer = take_accelerometer(reader, table);
  for (const AxisColumns& axes : reader.gyroscopes) {
    if (accelerometer && accelerometer->columns == axes.columns) continue;
    take_gyroscope(reader, axes, table);
    break;
  }
  return table;
}

ImuStream read_imu_file(const std::filesystem::path& path) {
  ImuTable table = read_table(path);
  std::string source = path.string();
  const bool has_turns = !table.gyroscope.empty();
  if (!has_turns || table.accelerometer.empty()) {
    const auto partner =
        find_partner(path, has_turns ? ImuSensor::kAccelerometer : ImuSensor::kGyroscope);
    ImuTable other = read_table(partner);
    source += " and " + partner.string();
    has_turns ? table.accelerometer.swap(other.accelerometer)
              : table.gyroscope.swap(other.gyroscope);
    table.notes.merge(other.notes);
  }
  ImuStream stream = merge_imu(table.gyroscope, std::move(table.accelerometer), source);
  std::ranges::copy(table.notes, std::back_inserter(stream.notes));
  return stream;
}

}  // namespace waymark

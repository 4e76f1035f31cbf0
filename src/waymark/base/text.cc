// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "waymark/base/check.h"
#include "waymark/base/regular_file.h"
#include "waymark/base/time_column.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxDigits = 64;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  return text;
}

template <class Integer>
std::optional<Integer> parse_integer(std::string_view text) {
  text = without_plus(text);
  Integer value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// How many bytes at the start are one character of UTF-8 that may be shown; 0: none is.
std::size_t printable_length(std::string_view text) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  if (first < 0xC2 || first > 0xF4) return 0;
  const std::size_t length = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool is_control = first == 0xC2 && byte(1) < 0xA0;
  return is_control ? 0 : length;
}

/// digits * 10^exponent, the sign apart.
struct Decimal {
  std::string digits;
  int exponent = 0;
  bool is_negative = false;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) {
    decimal.is_negative = text[0] == '-';
    text.remove_prefix(1);
  }
  bool has_point = false;
  std::size_t i = 0;
  for (; i < text.size() && (is_digit(text[i]) || (text[i] == '.' && !has_point)); ++i) {
    if (text[i] == '.') {
      has_point = true;
      continue;
    }
    decimal.digits += text[i];
    if (has_point) --decimal.exponent;
    if (decimal.digits.size() > kMaxDigits) return std::nullopt;
  }
  if (decimal.digits.empty()) return std::nullopt;
  if (i == text.size()) return decimal;
  if (text[i] != 'e' && text[i] != 'E') return std::nullopt;
  const std::optional<int> exponent = parse_integer<int>(text.substr(i + 1));
  if (!exponent || std::abs(static_cast<double>(*exponent)) > 1000) return std::nullopt;
  decimal.exponent += *exponent;
  return decimal;
}

/// The decimal as a whole number, rounded half away from zero; nothing on overflow.
std::optional<std::int64_t> to_integer(const Decimal& decimal) {
  std::int64_t value = 0;
  const int num_kept = static_cast<int>(decimal.digits.size()) + decimal.exponent;
  for (int i = 0; i < num_kept; ++i) {
    const bool is_given = i < static_cast<int>(decimal.digits.size());
    const int digit = is_given ? decimal.digits[static_cast<std::size_t>(i)] - '0' : 0;
    if (value > (INT64_MAX - digit) / 10) return std::nullopt;
    value = value * 10 + digit;
  }
  const bool rounds_up = num_kept >= 0 && num_kept < static_cast<int>(decimal.digits.size()) &&
                         decimal.digits[static_cast<std::size_t>(num_kept)] >= '5';
  if (rounds_up && value < INT64_MAX) ++value;
  return decimal.is_negative ? -value : value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  text = without_plus(text);
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_nanoseconds(std::string_view text) {
  return parse_integer<std::int64_t>(text);
}

std::optional<std::int64_t> parse_seconds(std::string_view text) {
  std::optional<Decimal> decimal = parse_decimal(text);
  if (!decimal) return std::nullopt;
  decimal->exponent += 9;
  return to_integer(*decimal);
}

std::string format_seconds(std::int64_t timestamp_ns) {
  const bool is_negative = timestamp_ns < 0;
  const std::uint64_t magnitude_ns = is_negative ? ~static_cast<std::uint64_t>(timestamp_ns) + 1
                                                 : static_cast<std::uint64_t>(timestamp_ns);
  return fmt::format("{}{}.{:09}",
                     is_negative ? "-" : "",
                     magnitude_ns / 1'000'000'000u,
                     magnitude_ns % 1'000'000'000u);
}

std::string format_decimals(double value, int num_decimals) {
  std::string text = fmt::format("{:.{}f}", value, num_decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}

RowReader::RowReader(std::string_view text, std::string name, char separator)
    : rest_(text), name_(std::move(name)), separator_(separator) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest_.substr(0, 3) == kByteOrderMark) rest_.remove_prefix(3);
}

bool RowReader::next() {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    const std::string_view line = trim(rest_.substr(0, end));
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    if (line.empty() || line.front() == '#') continue;
    split(line);
    return true;
  }
  return false;
}

void RowReader::split(std::string_view line) {
  fields_.clear();
  if (separator_ != ' ') {
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find(separator_, begin), line.size());
      fields_.push_back(trim(line.substr(begin, end - begin)));
      begin = end + 1;
    }
    return;
  }
  for (std::size_t begin = 0; begin < line.size();) {
    std::size_t end = begin;
    while (end < line.size() && !is_blank(line[end])) ++end;
    if (end > begin) fields_.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
}

std::string RowReader::where() const { return fmt::format("{}:{}", name_, line_); }

void RowReader::expect_at_least(std::size_t num_fields, std::string_view layout) const {
  if (fields_.size() >= num_fields) return;
  throw InputError(where(), fmt::format("{} fields, expected {}", fields_.size(), layout));
}

void RowReader::expect_exactly(std::size_t num_fields, std::string_view layout) const {
  if (fields_.size() == num_fields) return;
  throw InputError(where(), fmt::format("{} fields, expected {}", fields_.size(), layout));
}

void RowReader::fail(std::size_t index, std::string_view expected) const {
  throw InputError(
      where(),
      fmt::format(
          "field {} is {}, expected {}", index + 1, quote_for_message(fields_[index]), expected));
}

double RowReader::number(std::size_t index) const {
  WAYMARK_CHECK(index < fields_.size());
  const std::optional<double> value = parse_number(fields_[index]);
  if (!value) fail(index, "a finite number");
  return *value;
}

std::int64_t RowReader::nanoseconds(std::size_t index) const {
  WAYMARK_CHECK(index < fields_.size());
  const std::optional<std::int64_t> value = parse_nanoseconds(fields_[index]);
  if (!value || *value < 0) fail(index, "a time in whole nanoseconds, not negative");
  return *value;
}

std::string RowReader::relative_path(std::size_t index) const {
  WAYMARK_CHECK(index < fields_.size());
  const std::string_view field = fields_[index];
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  const std::filesystem::path path{std::string(field)};
  const bool climbs = std::find(path.begin(), path.end(), "..") != path.end();
  if (field.empty() || path.is_absolute() || climbs ||
      std::any_of(field.begin(), field.end(), is_control)) {
    fail(index, "a file name below the folder of the data set");
  }
  return path.string();
}

std::vector<std::int64_t> parse_times(std::string_view text, const std::string& name) {
  std::vector<std::int64_t> times_ns;
  const TimeColumn column(text, ' ');
  RowReader rows(text, name, ' ');
  while (rows.next()) {
    rows.expect_exactly(1, "1: a time in seconds");
    const std::int64_t time_ns = column.read(rows);
    if (!times_ns.empty() && time_ns <= times_ns.back()) {
      throw InputError(rows.where(), "not later than the time before, expected increasing times");
    }
    times_ns.push_back(time_ns);
  }
  if (times_ns.empty()) throw InputError(name, "empty, expected one time in seconds per image");
  return times_ns;
}

std::ifstream open_regular_file(const std::filesystem::path& path, std::string_view expected) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  const auto fail = [&](const char* what) {
    throw InputError(path.string(), fmt::format("{}, expected {}", what, expected));
  };
  if (!std::filesystem::exists(status)) fail("missing");
  if (!std::filesystem::is_regular_file(status)) fail("is no regular file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail("cannot be read");
  return stream;
}

std::string read_text_file(const std::filesystem::path& path,
                           std::string_view expected,
                           std::size_t max_bytes) {
  std::ifstream stream = open_regular_file(path, expected);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > max_bytes) {
    throw InputError(path.string(),
                     fmt::format("larger than {} MB, expected {}", max_bytes >> 20, expected));
  }
  std::string content(static_cast<std::size_t>(size), '\0');
  stream.read(content.data(), static_cast<std::streamsize>(size));
  if (!stream)
    throw InputError(path.string(), fmt::format("cannot be read, expected {}", expected));
  return content;
}

std::string printable(std::string_view text, bool has_lines) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = printable_length(text.substr(at));
    if (length > 0 || (has_lines && text[at] == '\n')) {
      result += text.substr(at, std::max<std::size_t>(length, 1));
    } else {
      result += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[at]));
    }
    at += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string quote_for_message(std::string_view text) {
  constexpr std::size_t kMaxLength = 40;
  std::string quoted = "'";
  for (char c : text.substr(0, kMaxLength)) {
    const bool is_printable = static_cast<unsigned char>(c) >= 0x20 && c != 0x7F;
    quoted += is_printable ? c : '?';
  }
  return quoted + (text.size() > kMaxLength ? "...'" : "'");
}

}  // namespace waymark

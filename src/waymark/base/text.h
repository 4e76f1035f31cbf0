// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A finite decimal number that fills the whole text, or nothing.
std::optional<double> parse_number(std::string_view text);

/// A whole number of nanoseconds that fills the whole text, or nothing.
std::optional<std::int64_t> parse_nanoseconds(std::string_view text);

/// Decimal seconds ("1305031229.528748", "1.037360e-01") to nanoseconds by decimal arithmetic, so
/// that no digit is lost to binary rounding; digits below a nanosecond round half away from zero.
/// Nothing when the text is no number or beyond 64-bit nanoseconds (about 292 years).
std::optional<std::int64_t> parse_seconds(std::string_view text);

/// Nanoseconds as seconds with exactly 9 decimals; parse_seconds() gives the same value back.
std::string format_seconds(std::int64_t timestamp_ns);

/// A number as texts are to show it: zero has no sign.
inline double unsigned_zero(double value) { return value == 0.0 ? 0.0 : value; }

/// A number with so many decimals; what rounds to zero has no sign.
std::string format_decimals(double value, int num_decimals);

/// How many of something there are: "1 loop", "2 loops". plural is given where it is not the noun
/// with an s.
template <std::integral T>
std::string count_of(T count, std::string_view noun, std::string_view plural = {}) {
  std::string text = std::to_string(count) + ' ';
  if (count == 1) return text.append(noun);
  return plural.empty() ? text.append(noun).append("s") : text.append(plural);
}

/// Reads rows of fields from text that came from outside. Blank lines and lines that start with '#'
/// are passed over; every error is an InputError that names file, line and what was expected.
class RowReader {
 public:
  /// Fields are separated by the separator; ' ' stands for any run of blanks and tabs. The text
  /// must outlive the reader; name is what errors call the file.
  RowReader(std::string_view text, std::string name, char separator);

  /// Steps to the next row; false at the end.
  bool next();

  /// Of the current row, without blanks around them.
  const std::vector<std::string_view>& fields() const { return fields_; }
  /// "NAME:LINE" of the current row.
  std::string where() const;

  /// Fails unless the current row has at least (exactly) this many fields.
  void expect_at_least(std::size_t num_fields, std::string_view layout) const;
  void expect_exactly(std::size_t num_fields, std::string_view layout) const;

  /// A field of the current row; fails when it is malformed. The index must exist. Times are not
  /// negative, so that differences of two cannot overflow.
  double number(std::size_t index) const;
  std::int64_t nanoseconds(std::size_t index) const;
  /// A path below the folder of a data set: relative and without "..".
  std::string relative_path(std::size_t index) const;

 private:
  [[noreturn]] void fail(std::size_t index, std::string_view expected) const;
  void split(std::string_view line);

  std::string_view rest_;
  std::string name_;
  char separator_;
  std::size_t line_ = 0;
  std::vector<std::string_view> fields_;
};

/// One time in seconds per row, strictly increasing, at least one; nanoseconds come back.
std::vector<std::int64_t> parse_times(std::string_view text, const std::string& name);

/// Content of a regular file. Throws InputError when it is missing, unreadable or larger than
/// max_bytes; expected says what the file should have been.
std::string read_text_file(const std::filesystem::path& path,
                           std::string_view expected,
                           std::size_t max_bytes = std::size_t{256} << 20);

/// Text fit for a terminal: control characters (of ASCII, and the C1 set of Unicode) and bytes that
/// are not UTF-8 come out as \xNN; ends of lines stay where the text is to have several.
std::string printable(std::string_view text, bool has_lines = false);

/// A piece of foreign text made fit for a one-line message: quoted, shortened, printable.
std::string quote_for_message(std::string_view text);

}  // namespace waymark

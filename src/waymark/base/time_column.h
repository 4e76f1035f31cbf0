// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "waymark/base/text.h"

namespace waymark {

/// How many nanoseconds a count of a column of times stands for: those of a second, of a
/// millisecond, of a microsecond, or 1. Times beyond 9.2e9, or 1e6 and more apart, are no seconds.
/// They are nanoseconds, unless they are milliseconds or microseconds of this century, which as
/// nanoseconds would be less than 2 ms apart. Texts that are no numbers say nothing.
std::int64_t time_unit_ns(std::span<const std::string_view> times);

/// A time in such a unit to nanoseconds, as parse_seconds() does.
std::optional<std::int64_t> parse_time(std::string_view text, std::int64_t unit_ns);

/// Times that begin the rows of a file, in the unit that the first thousand tell.
class TimeColumn {
 public:
  /// Separator: as of RowReader.
  TimeColumn(std::string_view text, char separator);
  /// Of the current row, in nanoseconds. Throws InputError where it is none, or negative.
  std::int64_t read(const RowReader& rows) const;

 private:
  std::int64_t unit_ns_;
};

}  // namespace waymark

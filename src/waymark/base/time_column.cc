// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/time_column.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/median.h"

namespace waymark {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
/// 64-bit nanoseconds reach so far.
constexpr double kMaxSeconds = 9.2e9;
/// This century, in seconds since 1970.
constexpr double kFirstSecond = 946'684'800.0;
constexpr double kLastSecond = 4'102'444'800.0;
/// Two images that are eleven days apart as seconds are 1 ms apart as nanoseconds.
constexpr double kMinStepOfNs = 1e6;
/// Where milliseconds of this century would be the nanoseconds of a clock that started lately.
constexpr double kMaxStepOfOthers = 2e6;

std::int64_t unit_of_column(std::string_view text, char separator) {
  constexpr std::size_t kNumRows = 1000;
  std::vector<std::string_view> times;
  RowReader rows(text, "", separator);
  while (times.size() < kNumRows && rows.next()) times.push_back(rows.fields().front());
  return time_unit_ns(times);
}

}  // namespace

std::int64_t time_unit_ns(std::span<const std::string_view> times) {
  std::vector<double> values, steps;
  for (const std::string_view time : times) {
    const std::optional<double> value = parse_number(time);
    if (!value) continue;
    if (!values.empty()) steps.push_back(std::abs(*value - values.back()));
    values.push_back(*value);
  }
  if (values.empty()) return kSecondNs;
  const double largest = *std::ranges::max_element(values);
  const double step = steps.empty() ? 0.0 : median(std::move(steps));
  if (largest <= kMaxSeconds && step < kMinStepOfNs) return kSecondNs;
  for (const std::int64_t unit_ns : {std::int64_t{1'000'000}, std::int64_t{1'000}}) {
    const double seconds = largest * static_cast<double>(unit_ns) / static_cast<double>(kSecondNs);
    const bool is_of_century = seconds >= kFirstSecond && seconds < kLastSecond;
    if (is_of_century && step > 0.0 && step < kMaxStepOfOthers) return unit_ns;
  }
  return 1;
}

std::optional<std::int64_t> parse_time(std::string_view text, std::int64_t unit_ns) {
  int exponent = 0;
  for (std::int64_t unit = unit_ns; unit < kSecondNs; unit *= 10) --exponent;
  const std::size_t mark = std::min(text.find_first_of("eE"), text.size());
  if (mark < text.size()) {
    const bool has_plus = text.substr(mark + 1).starts_with('+');
    const std::string_view stated = text.substr(mark + (has_plus ? 2 : 1));
    int value = 0;
    const auto result = std::from_chars(stated.data(), stated.data() + stated.size(), value);
    const bool is_whole = result.ec == std::errc{} && result.ptr == stated.data() + stated.size();
    if (!is_whole || std::abs(static_cast<double>(value)) > 1000) return std::nullopt;
    exponent += value;
  }
  return parse_seconds(fmt::format("{}e{}", text.substr(0, mark), exponent));
}

TimeColumn::TimeColumn(std::string_view text, char separator)
    : unit_ns_(unit_of_column(text, separator)) {}

std::int64_t TimeColumn::read(const RowReader& rows) const {
  const std::string_view text = rows.fields().front();
  const std::optional<std::int64_t> time_ns = parse_time(text, unit_ns_);
  if (time_ns && *time_ns >= 0) return *time_ns;
  throw InputError(rows.where(),
                   fmt::format("field 1 is {}, expected a time in seconds from 0 to 9.2e9",
                               quote_for_message(text)));
}

}  // namespace waymark

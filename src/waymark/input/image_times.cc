// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/image_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
namespace waymark {
namespace {

// This century in seconds since 1970.
constexpr std::int64_t kFirstSecond = 946'684'800;
constexpr std::int64_t kLastSecond = 4'102'444'800;

bool is_all_digits(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return is_digit(c); });
}

/// A time, and in how many nanoseconds it counts (0: seconds with decimals).
struct NamedTime {
  std::int64_t time_ns = 0;
  std::int64_t unit_ns = 0;
};

std::optional<NamedTime> time_in_name(std::string_view name) {
  const std::size_t point = name.find('.');
  if (point != std::string_view::npos) {
    const bool is_decimal =
        is_all_digits(name.substr(0, point)) && is_all_digits(name.substr(point + 1));
    const std::optional<std::int64_t> time_ns = is_decimal ? parse_seconds(name) : std::nullopt;
    const bool is_likely = time_ns && *time_ns / 1'000'000'000 >= kFirstSecond &&
                           *time_ns / 1'000'000'000 < kLastSecond;
    return is_likely ? std::optional(NamedTime{*time_ns, 0}) : std::nullopt;
  }
  if (!is_all_digits(name)) return std::nullopt;
  const std::optional<std::int64_t> value = parse_nanoseconds(name);
  if (!value) return std::nullopt;
  constexpr std::array<std::int64_t, 3> kUnits = {1, 1'000, 1'000'000};
  for (const std::int64_t unit_ns : kUnits) {
    const std::int64_t second = 1'000'000'000 / unit_ns;
    if (*value < kFirstSecond * second || *value >= kLastSecond * second) continue;
    return NamedTime{*value * unit_ns, unit_ns};
  }
  return std::nullopt;
}

std::string_view without_blanks(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

std::optional<std::vector<std::int64_t>> times_in_names(
    const std::vector<std::filesystem::path>& images) {
  std::vector<std::int64_t> times_ns;
  std::optional<std::int64_t> unit_ns;
  for (const std::filesystem::path& image : images) {
    const std::optional<NamedTime> time = time_in_name(image.stem().string());
    if (!time || (unit_ns && *unit_ns != time->unit_ns)) return std::nullopt;
    unit_ns = time->unit_ns;
    times_ns.push_back(time->time_ns);
  }
  return times_ns;
}

ImageList parse_image_list(std::string_view text, const std::string& name) {
  ImageList list;
  std::vector<std::string_view> times;
  RowReader rows(text, name, '\n');
  while (rows.next()) {
    const std::string_view line = rows.fields().front();
    const std::string_view first = line.substr(0, line.find_first_of(" \t"));
    const std::optional<double> time = parse_number(first);
    const bool has_time = time && *time >= 0.0 && first.size() < line.size();
    if (!list.images.empty() && has_time == times.empty()) {
      throw InputError(rows.where(),
                       fmt::format("{} a time, expected one in every line or in none",
                                   has_time ? "has" : "has not"));
    }
    if (has_time) times.push_back(first);
    list.images.emplace_back(without_blanks(has_time ? line.substr(first.size()) : line));
  }
  if (list.images.empty()) {
    throw InputError(name, "holds no line, expected one path of an image per line");
  }
  const std::int64_t unit_ns = time_unit_ns(times);
  for (const std::string_view time : times) {
    const std::optional<std::int64_t> time_ns = parse_time(time, unit_ns);
    if (!time_ns) throw InputError(name, quote_for_message(time) + " is no time, expected seconds");
    list.times_ns.push_back(*time_ns);
  }
  return list;
}

}  // namespace waymark

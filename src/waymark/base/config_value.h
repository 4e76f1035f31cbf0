// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"

namespace waymark {

/// Range of allowed values, ends included.
struct ConfigRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// Strict conversions. Anything else than what the name says is an InputError such as
/// "FILE:LINE: tracking.min_inliers is 7, expected an integer from 10 to 1000". `key` is the dotted
/// name for messages. Numbers are decimal and finite.
bool config_bool(const ConfigNode& node, std::string_view key);
int config_int(const ConfigNode& node, std::string_view key, const ConfigRange& range = {});
double config_double(const ConfigNode& node, std::string_view key, const ConfigRange& range = {});
std::string config_string(const ConfigNode& node, std::string_view key);
/// A list of numbers; each in the range.
std::vector<double> config_doubles(const ConfigNode& node,
                                   std::string_view key,
                                   const ConfigRange& range = {});

/// "an integer from 10 to 1000", "a number of at least 0" and the like; noun with its article.
std::string describe_range(std::string_view noun, const ConfigRange& range);

/// How messages show what was written: 7, [1, 2], a list of 9 values, a section, nothing.
std::string describe_value(const ConfigNode& node);

/// InputError for a key that nobody knows, with the nearest of the known ones (dotted), if one is
/// near, else with those of the same section.
[[noreturn]] void fail_unknown_key(const ConfigNode& value,
                                   std::string_view key,
                                   const std::vector<std::string>& known_keys);

/// Smallest number of insertions, deletions, substitutions and swaps of neighbours that make b of a
/// (Damerau 1964, each place edited once).
int edit_distance(std::string_view a, std::string_view b);

}  // namespace waymark

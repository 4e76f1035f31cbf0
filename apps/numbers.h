// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>

#include "waymark/base/text.h"

/// What numbers of the command line may be. The parser's own checks let "nan" pass.
namespace waymark {

/// A number from low to high.
inline CLI::Validator number_between(double low, double high) {
  const auto check = [low, high](const std::string& text) {
    const std::optional<double> number = parse_number(text);
    if (number && *number >= low && *number <= high) return std::string();
    return fmt::format("is {}, expected a number from {} to {}", text, low, high);
  };
  return CLI::Validator(check, fmt::format("[{} to {}]", low, high));
}

/// A whole number of digits alone, from least on.
inline CLI::Validator whole_from(std::size_t least) {
  const auto check = [least](const std::string& text) {
    const std::optional<double> number = parse_number(text);
    const bool is_whole = std::ranges::all_of(text, is_digit);
    if (is_whole && number && *number >= static_cast<double>(least)) return std::string();
    return fmt::format("is {}, expected {} or more", text, least);
  };
  return CLI::Validator(check, fmt::format("[{} or more]", least));
}

}  // namespace waymark

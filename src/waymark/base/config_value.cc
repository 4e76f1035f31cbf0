// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/config_value.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr std::size_t kLongestShown = 40;

[[noreturn]] void fail_value(const ConfigNode& node,
                             std::string_view key,
                             const std::string& expected) {
  throw InputError(node.where(),
                   fmt::format("{} is {}, expected {}", key, describe_value(node), expected));
}

/// A scalar as a number of this type and nothing else.
template <class T>
std::optional<T> parse_number(const ConfigNode& node) {
  if (node.kind != ConfigNode::Kind::kScalar) return std::nullopt;
  std::string_view text = node.scalar;
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_finite(const ConfigNode& node, const ConfigRange& range) {
  const std::optional<double> value = parse_number<double>(node);
  const bool is_good =
      value && std::isfinite(*value) && *value >= range.low && *value <= range.high;
  return is_good ? value : std::nullopt;
}

std::string shortened(const std::string& text) {
  std::string line = text.substr(0, kLongestShown);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text.size() > kLongestShown ? line + "..." : line;
}

std::string section_of(std::string_view key) {
  const std::size_t dot = key.rfind('.');
  return dot == std::string_view::npos ? "" : std::string(key.substr(0, dot + 1));
}

std::string name_of(std::string_view key) {
  return std::string(key.substr(section_of(key).size()));
}

}  // namespace

bool config_bool(const ConfigNode& node, std::string_view key) {
  if (node.kind == ConfigNode::Kind::kScalar && node.scalar == "true") return true;
  if (node.kind == ConfigNode::Kind::kScalar && node.scalar == "false") return false;
  fail_value(node, key, "true or false");
}

int config_int(const ConfigNode& node, std::string_view key, const ConfigRange& range) {
  const std::optional<int> value = parse_number<int>(node);
  if (!value || *value < range.low || *value > range.high) {
    fail_value(node, key, describe_range("an integer", range));
  }
  return *value;
}

double config_double(const ConfigNode& node, std::string_view key, const ConfigRange& range) {
  const std::optional<double> value = parse_finite(node, range);
  if (!value) fail_value(node, key, describe_range("a number", range));
  return *value;
}

std::string config_string(const ConfigNode& node, std::string_view key) {
  if (node.kind != ConfigNode::Kind::kScalar) fail_value(node, key, "a text");
  return node.scalar;
}

std::vector<double> config_doubles(const ConfigNode& node,
                                   std::string_view key,
                                   const ConfigRange& range) {
  const std::string expected = describe_range("a list [...] of numbers, each", range);
  if (node.kind != ConfigNode::Kind::kList) fail_value(node, key, expected);
  std::vector<double> values;
  for (const ConfigNode& item : node.items) {
    const std::optional<double> value = parse_finite(item, range);
    if (!value) {
      fail_value(
          item, fmt::format("{}[{}]", key, values.size()), describe_range("a number", range));
    }
    values.push_back(*value);
  }
  return values;
}

std::string describe_range(std::string_view noun, const ConfigRange& range) {
  if (std::isfinite(range.low) && std::isfinite(range.high)) {
    return fmt::format("{} from {} to {}", noun, range.low, range.high);
  }
  if (std::isfinite(range.low)) return fmt::format("{} of at least {}", noun, range.low);
  if (std::isfinite(range.high)) return fmt::format("{} of at most {}", noun, range.high);
  return std::string(noun);
}

std::string describe_value(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kNull:
      return "empty";
    case ConfigNode::Kind::kScalar:
      return node.scalar.empty() ? "''" : shortened(node.scalar);
    case ConfigNode::Kind::kList:
      return fmt::format("a list of {}", node.items.size());
    case ConfigNode::Kind::kMap:
      return "a section";
  }
  return "";
}

void fail_unknown_key(const ConfigNode& value,
                      std::string_view key,
                      const std::vector<std::string>& known_keys) {
  const std::string message = fmt::format("unknown key '{}'", shortened(std::string(key)));
  const std::string name = name_of(key);
  int smallest = std::max(2, static_cast<int>(name.size()) / 3) + 1;
  const std::string* nearest = nullptr;
  std::vector<std::string> siblings;
  if (key.size() > 200) throw InputError(value.where(), message);
  for (const std::string& known : known_keys) {
    // The right name in the wrong section is near, too.
    const int distance =
        std::min(edit_distance(key, known), edit_distance(name, name_of(known)) + 1);
    if (distance < smallest) {
      smallest = distance;
      nearest = &known;
    }
    if (section_of(known) == section_of(key)) siblings.push_back(name_of(known));
  }
  if (nearest != nullptr) {
    throw InputError(value.where(), fmt::format("{}, did you mean '{}'?", message, *nearest));
  }
  throw InputError(value.where(),
                   siblings.empty()
                       ? message
                       : fmt::format("{}, expected one of {}", message, fmt::join(siblings, ", ")));
}

int edit_distance(std::string_view a, std::string_view b) {
  // Rows of the table of distances between prefixes: the last, the one before, the current one.
  std::vector<int> previous(b.size() + 1), before(b.size() + 1), current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int substitution = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substitution});
      const bool is_swap = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swap) current[j] = std::min(current[j], before[j - 2] + 1);
    }
    before.swap(previous);
    previous.swap(current);
  }
  return previous[b.size()];
}

}  // namespace waymark

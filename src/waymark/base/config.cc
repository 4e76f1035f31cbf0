// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxSize = std::size_t{1} << 20;

/// Lays `over` over `node`.
void merge_into(ConfigNode& node, ConfigNode&& over) {
  if (node.kind != ConfigNode::Kind::kMap || over.kind != ConfigNode::Kind::kMap) {
    // "section:" with nothing below changes nothing of a section given before.
    const bool is_empty_section =
        node.kind == ConfigNode::Kind::kMap && over.kind == ConfigNode::Kind::kNull;
    if (!is_empty_section) node = std::move(over);
    return;
  }
  for (std::size_t i = 0; i < over.items.size(); ++i) {
    const auto known = std::find(node.keys.begin(), node.keys.end(), over.keys[i]);
    if (known == node.keys.end()) {
      node.keys.push_back(std::move(over.keys[i]));
      node.items.push_back(std::move(over.items[i]));
    } else {
      merge_into(node.items[static_cast<std::size_t>(known - node.keys.begin())],
                 std::move(over.items[i]));
    }
  }
}

}  // namespace

std::string ConfigNode::where() const {
  const std::string name = file ? *file : "settings";
  return line > 0 ? fmt::format("{}:{}", name, line) : name;
}

const ConfigNode* ConfigNode::find(std::string_view key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  return found == keys.end() ? nullptr : &items[static_cast<std::size_t>(found - keys.begin())];
}

ConfigSource ConfigSource::from_file(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw InputError(path.string(), "is a folder, expected a YAML file");
  }
  // A pipe that a shell has opened, -c <(command), ends; one with a name may have no writer.
  const bool is_of_shell =
      path.string().starts_with("/dev/") || path.string().starts_with("/proc/");
  if (std::filesystem::is_fifo(path, error) && !is_of_shell) {
    throw InputError(path.string(), "is a pipe, expected a YAML file");
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path.string(), "cannot be opened, expected a YAML file");
  std::string text(kMaxSize + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) throw InputError(path.string(), "cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  text.shrink_to_fit();
  if (text.size() > kMaxSize) {
    throw InputError(path.string(), "is larger than 1 MiB, expected settings as YAML");
  }
  return {path.string(), std::move(text)};
}

ConfigSource ConfigSource::from_assignment(std::string_view assignment) {
  const std::size_t equal = assignment.find('=');
  const std::string where = fmt::format("--set {}", assignment);
  if (equal == std::string_view::npos) throw InputError(where, "has no '=', expected KEY=VALUE");
  const std::string_view key = assignment.substr(0, equal);
  if (key.empty() || key.front() == '.' || key.back() == '.' ||
      key.find("..") != std::string_view::npos) {
    throw InputError(where, "has no valid key, expected one like features.count=1500");
  }
  return {where, std::string(assignment.substr(equal + 1)), std::string(key)};
}

ConfigNode merge_configs(const std::vector<ConfigSource>& sources) {
  ConfigNode merged;
  merged.kind = ConfigNode::Kind::kMap;
  for (const ConfigSource& source : sources) merge_into(merged, parse_config(source));
  return merged;
}

}  // namespace waymark

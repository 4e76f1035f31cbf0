// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Settings and cameras are YAML; what is given later replaces what was given before.
//
//   const ConfigNode config = merge_configs({ConfigSource::from_file("camchain.yaml"),
//                                            ConfigSource::from_assignment("features.count=1500")});
//   Settings changed;
//   read_settings(changed, config);
//   const std::optional<CameraChain> chain = read_camchain(config);

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// A value of a YAML document, which remembers where it was written.
struct ConfigNode {
  /// The kinds of YAML values; numbers, words and true are scalars.
  enum class Kind { kNull, kScalar, kList, kMap };

  Kind kind = Kind::kNull;                  ///< Nothing was written: null.
  std::string scalar;                       ///< As written, without quotes.
  std::vector<std::string> keys;            ///< Of a map, as many as items, in the order written.
  std::vector<ConfigNode> items;            ///< Elements of a list, values of a map.
  std::shared_ptr<const std::string> file;  ///< Name of the source; null: none.
  int line = 0;  ///< From 1; of a value in a map the line of its key. 0: no file.

  /// "FILE:LINE", as error messages begin.
  std::string where() const;
  /// The value of a key of a map, or nullptr.
  const ConfigNode* find(std::string_view key) const;
};

/// Text of YAML from somewhere.
struct ConfigSource {
  std::string name;      ///< Of the file, for messages.
  std::string text;      ///< YAML, UTF-8.
  std::string key = {};  ///< Dotted key that the text is the value of; empty: the whole document.

  /// Reads a file. Throws InputError when it is missing, unreadable or larger than 1 MiB.
  static ConfigSource from_file(const std::filesystem::path& path);
  /// "KEY=VALUE" as on the command line, KEY dotted: "features.count=1500".
  static ConfigSource from_assignment(std::string_view assignment);
};

/// Parses one document with a map at its top (or nothing at all). What is malformed, has duplicate
/// keys, aliases, more than 1 MiB, 32 levels or 100 000 values is an InputError with its line.
ConfigNode parse_config(const ConfigSource& source);

/// Parses the sources and lays them over each other: of maps, keys given later replace earlier
/// ones; lists are replaced as a whole.
ConfigNode merge_configs(const std::vector<ConfigSource>& sources);

}  // namespace waymark

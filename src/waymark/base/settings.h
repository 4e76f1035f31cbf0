// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/base/config.h"

namespace waymark {

/// What describes one setting beside its name and default. A settings struct lists its fields once:
///
///   struct FeatureSettings {
///     int count = 1000;
///     template <class Self, class Field>
///     static void describe(Self& self, Field&& field) {
///       field("count", self.count, SettingInfo{.low = 100, .high = 20000,
///                                              .help = "Features per image."});
///     }
///   };
///
/// Reader, writer, help and documentation come from describe(). Fields are bool, int, double,
/// std::string, std::vector<double> (the range is that of each element), or again such structs.
struct SettingInfo {
  double low = -std::numeric_limits<double>::infinity();  ///< Smallest allowed value.
  double high = std::numeric_limits<double>::infinity();  ///< Largest allowed value.
  const char* unit = "";  ///< Of the value, for people; empty: a number or a ratio.
  const char* help = "";  ///< One sentence.
};

/// Range of a constant of a stage, whose reason stands beside it in its struct (track/options.h).
inline constexpr SettingInfo within(double low, double high) { return {.low = low, .high = high}; }

/// One field of a settings struct, whatever its type. A section has no value.
struct SettingField {
  struct Section {};
  /// Pointer to the field.
  using Value = std::variant<Section, bool*, int*, double*, std::string*, std::vector<double>*>;

  std::string key;   ///< Dotted: "features.count".
  Value value;       ///< Where the field is; valid as long as the settings that were listed.
  SettingInfo info;  ///< Range, unit and help.
};

/// All fields in the order described, a section before its fields.
template <class Settings>
std::vector<SettingField> list_settings(Settings& settings, const std::string& prefix = "") {
  std::vector<SettingField> fields;
  Settings::describe(settings, [&]<class T>(const char* name, T& value, const SettingInfo& info) {
    const std::string key = prefix + name;
    if constexpr (std::is_constructible_v<SettingField::Value, T*>) {
      fields.push_back({key, &value, info});
    } else {
      fields.push_back({key, SettingField::Section{}, info});
      for (SettingField& field : list_settings(value, key + ".")) {
        fields.push_back(std::move(field));
      }
    }
  });
  return fields;
}

/// Sets the fields that the document names. An unknown key, a wrong type or a value out of range is
/// an InputError with the line and what was expected; the settings may be half set then. The keys
/// of the calibration in the same document (cam0, cam1, ... and depth.factor) are passed over:
/// camera/camchain.h reads them.
void read_settings(const std::vector<SettingField>& fields, const ConfigNode& config);

/// The same for a whole settings struct.
template <class Settings>
void read_settings(Settings& settings, const ConfigNode& config) {
  read_settings(list_settings(settings), config);
}

/// The same of several sources, later ones over earlier ones.
template <class Settings>
void read_settings(Settings& settings, const std::vector<ConfigSource>& sources) {
  read_settings(list_settings(settings), merge_configs(sources));
}

/// The settings as a YAML document that read_settings accepts, with help, range, unit and default
/// of each as comments; of the section `experiment` only what is not as by default. `defaults` are
/// the same fields with default values.
std::string settings_as_yaml(const std::vector<SettingField>& fields,
                             const std::vector<SettingField>& defaults);

/// The same for a whole settings struct.
template <class Settings>
std::string settings_as_yaml(Settings settings) {
  Settings defaults;
  return settings_as_yaml(list_settings(settings), list_settings(defaults));
}

/// Fields that are not as by default, "KEY: VALUE" each, with dotted keys.
std::vector<std::string> changed_settings(const std::vector<SettingField>& fields,
                                          const std::vector<SettingField>& defaults);

/// The same for a whole settings struct.
template <class Settings>
std::vector<std::string> changed_settings(Settings settings) {
  Settings defaults;
  return changed_settings(list_settings(settings), list_settings(defaults));
}

/// The settings but for the section `experiment` as Markdown: a table of key, default, range, unit,
/// meaning, for each section one under its heading.
std::string settings_as_markdown(const std::vector<SettingField>& fields);

/// The same for the defaults of a settings struct.
template <class Settings>
std::string settings_as_markdown() {
  Settings defaults;
  return settings_as_markdown(list_settings(defaults));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"

namespace waymark {
namespace {

using Section = SettingField::Section;

/// Keys of the calibration, which shares the document: cam0, cam1, ... and depth.factor.
bool is_calibration_key(std::string_view key) {
  if (key == "depth" || key == "depth.factor") return true;
  return key.size() > 3 && key.starts_with("cam") &&
         std::all_of(key.begin() + 3, key.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool is_section(const SettingField& field) { return std::holds_alternative<Section>(field.value); }

/// Sets the field that a value of the document names.
struct ValueReader {
  const ConfigNode& node;
  const SettingField& field;

  ConfigRange range() const { return {field.info.low, field.info.high}; }
  void operator()(Section) const {}
  void operator()(bool* value) const { *value = config_bool(node, field.key); }
  void operator()(int* value) const { *value = config_int(node, field.key, range()); }
  void operator()(double* value) const { *value = config_double(node, field.key, range()); }
  void operator()(std::string* value) const { *value = config_string(node, field.key); }
  void operator()(std::vector<double>* value) const {
    *value = config_doubles(node, field.key, range());
  }
};

void read_section(const std::vector<SettingField>& fields,
                  const ConfigNode& section,
                  const std::string& prefix) {
  for (std::size_t i = 0; i < section.items.size(); ++i) {
    const ConfigNode& node = section.items[i];
    const std::string key = prefix + section.keys[i];
    if (section.keys[i].find('.') != std::string::npos) {
      throw InputError(node.where(),
                       fmt::format("unknown key '{}', expected sections instead of dots", key));
    }
    const auto field = std::find_if(
        fields.begin(), fields.end(), [&](const SettingField& known) { return known.key == key; });
    const bool is_known = field != fields.end();
    if (is_known && !is_section(*field)) {
      std::visit(ValueReader{node, *field}, field->value);
    } else if (is_known || key == "depth") {
      if (node.kind == ConfigNode::Kind::kNull) continue;
      if (node.kind != ConfigNode::Kind::kMap) {
        throw InputError(
            node.where(),
            fmt::format("{} is {}, expected a section of KEY: VALUE", key, describe_value(node)));
      }
      read_section(fields, node, key + ".");
    } else if (!is_calibration_key(key)) {
      std::vector<std::string> known_keys = {"cam0", "cam1", "depth.factor"};
      for (const SettingField& known : fields) {
        if (!is_calibration_key(known.key)) known_keys.push_back(known.key);
      }
      fail_unknown_key(node, key, known_keys);
    }
  }
}

}  // namespace

void read_settings(const std::vector<SettingField>& fields, const ConfigNode& config) {
  read_section(fields, config, "");
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdint>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"

namespace waymark {
namespace {

using Section = SettingField::Section;

/// Keys of the calibration, which shares the document: cam0, cam1, ..., imu0 and depth.factor.
bool is_calibration_key(std::string_view key) {
  if (key == "depth" || key == "depth.factor" || key == "imu0") return true;
  return key.size() > 3 && key.starts_with("cam") &&
         std::all_of(key.begin() + 3, key.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool is_section(const SettingField& field) { return std::holds_alternative<Section>(field.value); }

/// Constants of stages, which change from version to version: written only where they were changed.
bool is_experiment(const SettingField& field) {
  return field.key == "experiment" || field.key.starts_with("experiment.");
}

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

constexpr std::size_t kLineWidth = 100;

/// A value as YAML.
struct ValuePrinter {
  std::string operator()(Section) const { return ""; }
  std::string operator()(const bool* value) const { return *value ? "true" : "false"; }
  std::string operator()(const int* value) const { return fmt::format("{}", *value); }
  std::string operator()(const double* value) const { return fmt::format("{}", *value); }
  std::string operator()(const std::string* value) const {
    std::string quoted = "\"";
    for (const char c : *value) {
      if (c == '"' || c == '\\') quoted += '\\';
      quoted += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    return quoted + "\"";
  }
  std::string operator()(const std::vector<double>* values) const {
    return fmt::format("[{}]", fmt::join(*values, ", "));
  }
};

/// What may be written for a field, without its range.
struct NounPrinter {
  const char* operator()(Section) const { return ""; }
  const char* operator()(const bool*) const { return "true or false"; }
  const char* operator()(const int*) const { return "integer"; }
  const char* operator()(const double*) const { return "number"; }
  const char* operator()(const std::string*) const { return "text"; }
  const char* operator()(const std::vector<double>*) const { return "list of numbers"; }
};

std::string printed_value(const SettingField& field) {
  return std::visit(ValuePrinter{}, field.value);
}

/// The fields to write: experiments where they, or what is below them, are not as by default.
std::vector<std::uint8_t> choose_written(const std::vector<SettingField>& fields,
                                         const std::vector<SettingField>& defaults) {
  std::vector<std::uint8_t> is_written(fields.size());
  for (std::size_t i = fields.size(); i-- > 0;) {
    is_written[i] = !is_experiment(fields[i]);
    if (is_section(fields[i])) {
      const std::string prefix = fields[i].key + ".";
      for (std::size_t k = i + 1; k < fields.size() && fields[k].key.starts_with(prefix); ++k) {
        is_written[i] |= is_written[k];
      }
    } else {
      is_written[i] |= printed_value(fields[i]) != printed_value(defaults[i]);
    }
  }
  return is_written;
}

std::string printed_range(const SettingField& field) {
  return describe_range(std::visit(NounPrinter{}, field.value), {field.info.low, field.info.high});
}

/// The text as comment lines of at most kLineWidth characters.
std::string comment(std::string_view text, std::size_t indent) {
  const std::string start = std::string(indent, ' ') + "#";
  std::string result, line = start;
  while (!text.empty()) {
    const std::size_t space = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, space);
    if (line.size() + 1 + word.size() > kLineWidth && line != start) {
      result += line + "\n";
      line = start;
    }
    line += fmt::format(" {}", word);
    text.remove_prefix(std::min(space + 1, text.size()));
  }
  return line == start ? result : result + line + "\n";
}

std::string describe_field(const SettingField& field, const SettingField& default_field) {
  std::string text = field.info.help;
  if (!text.empty()) text += " ";
  text += fmt::format("({}", printed_range(field));
  if (*field.info.unit != '\0') text += fmt::format(", in {}", field.info.unit);
  return text + fmt::format("; default {})", printed_value(default_field));
}

}  // namespace

void read_settings(const std::vector<SettingField>& fields, const ConfigNode& config) {
  read_section(fields, config, "");
}

std::string settings_as_yaml(const std::vector<SettingField>& fields,
                             const std::vector<SettingField>& defaults) {
  WAYMARK_CHECK(fields.size() == defaults.size());
  std::string yaml;
  const std::vector<std::uint8_t> is_written = choose_written(fields, defaults);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!is_written[i]) continue;
    const std::string& key = fields[i].key;
    const std::size_t indent =
        2 * static_cast<std::size_t>(std::count(key.begin(), key.end(), '.'));
    const std::string name = std::string(indent, ' ') + key.substr(key.rfind('.') + 1);
    if (std::holds_alternative<Section>(fields[i].value)) {
      if (!yaml.empty()) yaml += "\n";
      yaml += comment(fields[i].info.help, indent) + name + ":\n";
    } else {
      yaml += comment(describe_field(fields[i], defaults[i]), indent);
      yaml += fmt::format("{}: {}\n", name, printed_value(fields[i]));
    }
  }
  return yaml;
}

std::vector<std::string> changed_settings(const std::vector<SettingField>& fields,
                                          const std::vector<SettingField>& defaults) {
  WAYMARK_CHECK(fields.size() == defaults.size());
  std::vector<std::string> changed;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string value = printed_value(fields[i]);
    if (value != printed_value(defaults[i])) changed.push_back(fields[i].key + ": " + value);
  }
  return changed;
}

std::string settings_as_markdown(const std::vector<SettingField>& fields) {
  constexpr const char* kHead =
      "| key | default | range | unit | meaning |\n|---|---|---|---|---|\n";
  std::string text = kHead;
  for (const SettingField& field : fields) {
    if (is_experiment(field)) continue;
    if (std::holds_alternative<Section>(field.value)) {
      text += fmt::format("\n## {}\n\n{}\n\n{}", field.key, field.info.help, kHead);
    } else {
      text += fmt::format("| `{}` | `{}` | {} | {} | {} |\n",
                          field.key,
                          printed_value(field),
                          printed_range(field),
                          field.info.unit,
                          field.info.help);
    }
  }
  return text;
}

}  // namespace waymark

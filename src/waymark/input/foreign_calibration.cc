// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/foreign_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/xml_tree.h"

namespace waymark {
namespace {

/// The first row that is no comment; nothing where that is longer than the row of a camera.
std::optional<std::string_view> first_row(std::string_view text) {
  constexpr std::size_t kLongestRow = 1000;
  while (!text.empty()) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), row.size() + 1));
    if (row.find_first_not_of(" \t\r") == std::string_view::npos || row.front() == '#') continue;
    return row.size() > kLongestRow ? std::nullopt : std::optional(row);
  }
  return std::nullopt;
}

std::vector<std::string_view> fields_of(std::string_view row) {
  RowReader rows(row, "", ' ');
  return rows.next() ? rows.fields() : std::vector<std::string_view>();
}

/// Whether a row that is no comment names a model after a number.
bool is_colmap_text(std::string_view row) {
  const std::vector<std::string_view> fields = fields_of(row);
  return fields.size() >= 5 && is_digit(fields[0].front()) &&
         std::ranges::all_of(fields[1], [](char c) { return c == '_' || (c >= 'A' && c <= 'Z'); });
}

/// camera.txt of DSO and of the TUM monoVO data set: four or five numbers, after the name of a
/// model or not.
bool is_dso_camera(std::string_view row) {
  constexpr std::array kModels = {"Pinhole", "RadTan", "EquiDistant", "FOV", "KannalaBrandt"};
  std::vector<std::string_view> fields = fields_of(row);
  const bool is_named =
      !fields.empty() && std::ranges::find(kModels, fields.front()) != kModels.end();
  if (is_named) fields.erase(fields.begin());
  return fields.size() >= 4 &&
         std::ranges::all_of(fields, [](auto field) { return parse_number(field).has_value(); });
}

/// InputError for files of other programs that are known, but not read.
void refuse_known(std::string_view row, const std::string& file) {
  const auto refuse = [&file](std::string_view kind) {
    throw InputError(file,
                     fmt::format("looks like {}, which is not read, expected its numbers as a "
                                 "camchain of Kalibr, or a file that is (docs/calibration.md)",
                                 kind));
  };
  if (row.starts_with("[LEFT_CAM_")) refuse("the factory calibration of a ZED");
  if (is_dso_camera(row)) refuse("camera.txt of DSO");
}

bool is_nerfstudio(const ConfigSource& source) {
  const std::size_t first = source.text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos || source.text[first] != '{') return false;
  return std::ranges::any_of(
      std::array{"\"frames\"", "\"fl_x\"", "\"camera_angle_x\""},
      [&](const char* key) { return source.text.find(key) != std::string::npos; });
}

CameraChain read_xml(const ConfigSource& source) {
  const auto [name, root] = parse_xml(source);
  if (name == "opencv_storage") return read_opencv_calibration(source);
  std::optional<CameraChain> chain =
      name == "calibration" ? read_named_calibration(root, source.name) : std::nullopt;
  if (chain) return *std::move(chain);
  throw InputError(source.name,
                   fmt::format("is XML of {}, expected opencv_storage of OpenCV, or calibration of "
                               "Metashape",
                               quote_for_message(name)));
}

CameraChain read_euroc_sensor(const ConfigSource& source) {
  CameraChain chain;
  chain.cameras.push_back({parse_euroc_sensor(source).description, Rigid3()});
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace

std::optional<CameraChain> read_foreign_calibration(const ConfigSource& source) {
  const std::string_view row = first_row(source.text).value_or("");
  if (source.name.ends_with(".bin") || is_colmap_text(row)) return read_colmap_calibration(source);
  if (is_nerfstudio(source)) return read_nerfstudio_calibration(source);
  if (is_xml(source)) return read_xml(source);
  refuse_known(row, source.name);
  if (is_ros_calibration(source)) return read_ros_calibration(source);
  const ConfigNode root = parse_config(without_opencv_header(source));
  if (is_opencv_calibration(root)) return read_opencv_calibration(source);
  if (root.find("sensor_type") != nullptr) return read_euroc_sensor(source);
  return read_named_calibration(root, source.name);
}

}  // namespace waymark

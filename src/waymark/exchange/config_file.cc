// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/config_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "waymark/base/text.h"
#include "waymark/exchange/openvslam_camera.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

/// transforms.json lists every frame.
constexpr std::size_t kMaxJsonBytes = std::size_t{256} << 20;

/// Whether keys of a settings file begin with this section, in either way of writing.
bool has_section(const ConfigNode& root, std::string_view section) {
  return std::ranges::any_of(root.keys, [section](const std::string& key) {
    return key.starts_with(section) && (key.size() == section.size() || key[section.size()] == '.');
  });
}

bool has_model(const ConfigNode& root) {
  const ConfigNode* camera = root.find("Camera");
  return root.find("Camera.model") != nullptr ||
         (camera != nullptr && camera->kind == ConfigNode::Kind::kMap);
}

}  // namespace

ConfigSource read_calibration_source(const std::filesystem::path& path) {
  if (path.extension() != ".json") return ConfigSource::from_file(path);
  return {path.string(), read_text_file(path, "transforms.json of nerfstudio", kMaxJsonBytes)};
}

std::optional<CameraChain> read_foreign_cameras(const ConfigSource& source) {
  if (const auto kind = recognize_calibration(source)) return read_calibration(*kind, source);
  const ConfigNode root = parse_config(without_opencv_header(source));
  if (root.kind != ConfigNode::Kind::kMap) return std::nullopt;
  if (has_section(root, "Camera1")) return read_orbslam_settings(source);
  if (!has_section(root, "Camera")) return std::nullopt;
  return has_model(root) ? read_openvslam_settings(source) : read_orbslam_settings(source);
}

ConfigSource read_config_file(const std::filesystem::path& path, std::vector<std::string>& notes) {
  ConfigSource source = read_calibration_source(path);
  const std::optional<CameraChain> chain = read_foreign_cameras(source);
  if (!chain) return source;
  notes.insert(notes.end(), chain->notes.begin(), chain->notes.end());
  notes.push_back(fmt::format("{}: {} as another program writes {}",
                              source.name,
                              chain->cameras.size() == 1 ? "a camera" : "two cameras",
                              chain->cameras.size() == 1 ? "it" : "them"));
  return {source.name, format_camchain(*chain)};
}

}  // namespace waymark

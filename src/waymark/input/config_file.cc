// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/config_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

/// transforms.json lists every frame.
constexpr std::size_t kMaxJsonBytes = std::size_t{256} << 20;

/// Whether keys are of Camera or Camera1, in sections or flat.
bool is_slam_settings(const ConfigNode& root) {
  return root.kind == ConfigNode::Kind::kMap &&
         std::ranges::any_of(root.keys, [](const std::string& key) {
           const std::string section = key.substr(0, key.find('.'));
           return section == "Camera" || section == "Camera1";
         });
}

}  // namespace

ConfigSource read_calibration_source(const std::filesystem::path& path) {
  if (path.extension() != ".json") return ConfigSource::from_file(path);
  return {path.string(), read_text_file(path, "transforms.json of nerfstudio", kMaxJsonBytes)};
}

CameraChain refuse_slam_settings(const ConfigSource& source) {
  throw InputError(
      source.name,
      fmt::format("has settings of OpenVSLAM or ORB-SLAM, expected a camchain: waymark "
                  "import --settings {} -o camchain.yaml",
                  source.name));
}

std::optional<CameraChain> read_foreign_cameras(const ConfigSource& source,
                                                SlamSettingsReader read_slam_settings) {
  if (auto chain = read_foreign_calibration(source)) return chain;
  if (!is_slam_settings(parse_config(without_opencv_header(source)))) return std::nullopt;
  return read_slam_settings(source);
}

std::vector<ConfigSource> read_config_files(std::span<const std::filesystem::path> paths,
                                            std::vector<std::string>& notes,
                                            SlamSettingsReader read_slam_settings) {
  std::vector<ConfigSource> sources;
  std::string of_camera;            // The last file of a camera of another program.
  std::optional<ConfigSource> ros;  // The same, of ROS, which may be one of a pair.
  std::size_t at = 0;               // Where that is among the sources.
  for (const std::filesystem::path& path : paths) {
    ConfigSource source = read_calibration_source(path);
    const bool is_ros = is_ros_calibration(source);
    const bool is_pair = is_ros && ros;
    const auto chain =
        is_pair ? read_ros_pair(*ros, source) : read_foreign_cameras(source, read_slam_settings);
    if (!chain) {
      // Kalibr's imu.yaml.
      if (parse_config(source).find("gyroscope_noise_density")) source.key = "imu0";
      sources.push_back(std::move(source));
      continue;
    }
    const std::string name = is_pair ? fmt::format("{}, {}", ros->name, source.name) : source.name;
    const bool is_one = chain->cameras.size() == 1;
    notes.insert(notes.end(), chain->notes.begin(), chain->notes.end());
    notes.push_back(fmt::format("{}: {} as another program writes {}",
                                name,
                                is_one ? "a camera" : "two cameras",
                                is_one ? "it" : "them"));
    if (!is_pair && !of_camera.empty()) {
      notes.push_back(fmt::format("{}: takes the place of what {} says", name, of_camera));
    }
    of_camera = name;
    ConfigSource camchain{name, format_camchain(*chain)};
    if (is_pair) {
      sources[at] = std::move(camchain);
      ros.reset();
      continue;
    }
    at = sources.size();
    ros = is_ros ? std::optional(std::move(source)) : std::nullopt;
    sources.push_back(std::move(camchain));
  }
  return sources;
}

ConfigSource read_config_file(const std::filesystem::path& path,
                              std::vector<std::string>& notes,
                              SlamSettingsReader read_slam_settings) {
  return read_config_files({&path, 1}, notes, read_slam_settings).front();
}

}  // namespace waymark

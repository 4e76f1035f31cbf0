// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/input/listing.h"

namespace waymark {

/// One row of camN/data.csv.
struct EurocImage {
  std::int64_t timestamp_ns = 0;
  std::string name;   ///< In camN/data.
  std::string where;  ///< File and line, for errors.
};

/// Rows "nanoseconds,name", times increasing, at least one. Throws InputError; name is what it
/// calls the file.
std::vector<EurocImage> parse_euroc_images(std::string_view text, const std::string& name);

/// camN/sensor.yaml.
struct EurocSensor {
  CameraDescription description;
  Rigid3 body_from_sensor;  ///< T_BS.
};

/// Parses sensor.yaml of a camera. Throws InputError.
EurocSensor parse_euroc_sensor(const ConfigSource& source);

/// Data set in the layout of EuRoC (Burri et al. 2016) and TUM-VI: mav0/cam0 and, for stereo,
/// mav0/cam1. folder is mav0 or the one that holds it. Calibration: sensor.yaml of each camera, or
/// dso/camchain.yaml beside mav0.
Listing list_euroc(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder is or holds a mav0 with a camera.
bool is_euroc(const std::filesystem::path& folder);

/// What turns a pose of the sensor of mav0/SENSOR/data.csv (ground truth is of the body) into one
/// of camera 0, from the sensor.yaml files of both; identity without that of camera 0.
Rigid3 euroc_sensor_from_camera0(const std::filesystem::path& csv_path);

}  // namespace waymark

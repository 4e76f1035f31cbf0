// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// The text of a calibration. Throws InputError when it is missing, unreadable, or larger than 1
/// MiB (JSON, which lists every frame: 256 MiB).
ConfigSource read_calibration_source(const std::filesystem::path& path);

/// The cameras of a calibration or settings file of another program, recognised by its content:
/// OpenCV, ROS, COLMAP, nerfstudio, OpenVSLAM and stella_vslam, ORB-SLAM2 and 3. Nothing for what
/// is none of them, such as a camchain. InputError for one that is malformed.
std::optional<CameraChain> read_foreign_cameras(const ConfigSource& source);

/// A file of cameras and settings as `-c` takes it: YAML of ours as it is; one of another program
/// turned into a camchain. What of it was passed over is appended to notes. Throws InputError.
ConfigSource read_config_file(const std::filesystem::path& path, std::vector<std::string>& notes);

}  // namespace waymark

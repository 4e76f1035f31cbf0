// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// The text of a calibration. Throws InputError when it is missing, unreadable, or larger than 1
/// MiB (JSON, which lists every frame: 256 MiB).
ConfigSource read_calibration_source(const std::filesystem::path& path);

/// Reads the cameras of settings of OpenVSLAM, stella_vslam, ORB-SLAM2 and 3, which are named by
/// their path. Throws InputError. A tool in Python does it (waymark.importing_settings).
using SlamSettingsReader = CameraChain (*)(const ConfigSource& source);

/// Where that tool is not at hand: InputError that names the command which converts them.
CameraChain refuse_slam_settings(const ConfigSource& source);

/// The cameras of a calibration or settings file of another program, recognised by its content:
/// those of read_foreign_calibration() and of SLAM programs. Nothing for what is none of them,
/// such as a camchain. InputError for one that is malformed.
std::optional<CameraChain> read_foreign_cameras(
    const ConfigSource& source, SlamSettingsReader read_slam_settings = refuse_slam_settings);

/// A file of cameras and settings as `-c` takes it: YAML of ours as it is; one of another program
/// turned into a camchain; Kalibr's imu.yaml becomes imu0 of ours. What of it was passed over is
/// appended to notes. Throws InputError.
ConfigSource read_config_file(const std::filesystem::path& path,
                              std::vector<std::string>& notes,
                              SlamSettingsReader read_slam_settings = refuse_slam_settings);
/// Several of them. Two cameras of ROS become the pair that they are of; else what comes later
/// takes the place of what came before, which notes say of other programs' files.
std::vector<ConfigSource> read_config_files(
    std::span<const std::filesystem::path> paths,
    std::vector<std::string>& notes,
    SlamSettingsReader read_slam_settings = refuse_slam_settings);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/timing.h"
#include "waymark/calibrate/calibrate.h"
#include "waymark/input/config_file.h"
#include "waymark/input/input.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/system/settings.h"
#include "waymark/system/system.h"

namespace waymark {

/// What the command line says about a session.
struct SessionOptions {
  std::filesystem::path input;
  std::vector<std::filesystem::path> configs;  ///< Cameras and settings, later ones override.
  std::vector<std::string> assignments;        ///< KEY=VALUE, override the files.
  SlamSettingsReader read_slam_settings = refuse_slam_settings;  ///< Of what is among the files.
  std::filesystem::path map_in;  ///< Map to go on in; empty: a new one.
  InputOptions reading;          ///< The calibration is filled in.
  Timing timing = Timing::kLockstep;
  std::optional<int> seed;  ///< Overrides the settings.
  /// Instead of what the configuration or the input says of the cameras, before --rotate and
  /// --resize; nothing: that.
  std::optional<CameraChain> calibration = std::nullopt;
  /// Of an input that carries no calibration, the only one of these whose images have its size.
  std::vector<CameraChain> known_cameras = {};
  /// How to calibrate from the images of an input that carries no calibration, its seed aside;
  /// nothing: such an input is an error.
  std::optional<CalibrateOptions> calibrate;
};

/// An input with its cameras and the settings to use it with.
struct PreparedInput {
  std::unique_ptr<Input> input;
  Settings settings;
  Rig rig;
  std::optional<EstimatedCalibration> estimated;  ///< Where the input carried no calibration.
  std::vector<std::string> description;           ///< What was understood, in words.
  InputOptions reading = {};                      ///< What the input was opened with.
};

/// An input and the system to feed it to.
struct Session : PreparedInput {
  KeyframeImages images;  ///< Of the map to go on in.
  std::unique_ptr<System> system;
};

/// What is in a map, in words.
std::string describe(const Map& map, const std::filesystem::path& path);

/// Reads the configuration and opens the input. Throws InputError.
PreparedInput prepare_input(const SessionOptions& options);

/// Prepares the input and makes the system for its cameras, with the map to go on in. Throws
/// InputError.
Session open_session(const SessionOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>

#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"
#include "waymark/system/settings.h"

namespace waymark::python {

namespace py = pybind11;

/// What the constructors of System and Localizer say of cameras and settings, as given.
struct ConfigArguments {
  py::object cameras;   ///< Calibration, path, dict, or several of the latter two.
  py::object setup;     ///< str or None.
  py::object settings;  ///< dict by dotted key or section, or None.
  py::object seed;      ///< int or None.
};

/// The same, understood.
struct SessionConfig {
  Rig rig;
  Settings settings;
  /// Nothing: one camera, with or without depth.
  std::optional<Setup> setup;
};

/// Throws TypeError for what is of another type, InputError for what is malformed.
SessionConfig read_session_config(const ConfigArguments& arguments);

/// Cameras as files and dicts describe them; InputError where there are none.
CameraChain read_cameras(py::handle cameras);

/// "mono", "stereo", "rgbd" or None; ValueError for others.
std::optional<Setup> setup_argument(py::handle setup);

/// A str or os.PathLike; TypeError for others.
std::filesystem::path path_argument(const char* name, py::handle path);

}  // namespace waymark::python

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/timing.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/depth.h"
#include "waymark/image/convert.h"
#include "waymark/imu/imu.h"
#include "waymark/input/input.h"
#include "waymark/system/settings.h"
#include "waymark/system/system.h"

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

/// "inline", "lockstep" or "realtime"; ValueError for others.
Timing timing_argument(const std::string& name);

/// The images of a moment as Python gives them; any but the first may be None.
struct ImageArguments {
  py::object image0;
  py::object image1;
  py::object depth;
  py::object mask;
};

/// An image as colour, of grey or colour; TypeError, ValueError as below.
ColorImage color_argument(const char* name, py::handle argument);

/// The images of a moment as the engine takes them: grey images and depth in units are borrowed
/// from the arrays, colour and depth in metres are converted. Made and destroyed with the GIL held.
class FrameArguments {
 public:
  /// TypeError for what has the wrong type, ValueError for a wrong shape and for images that the
  /// set-up (nothing: one camera, with or without depth) does not have or lacks.
  FrameArguments(const ImageArguments& images,
                 std::optional<Setup> setup,
                 const DepthSettings& depth_settings);
  FrameArguments(const FrameArguments&) = delete;
  FrameArguments& operator=(const FrameArguments&) = delete;

  FrameImages input(std::int64_t timestamp_ns) const;
  bool has_depth() const { return !input_.depth.is_empty(); }

 private:
  ImageView add_image(const char* name, py::handle argument);
  ImageView add_mask(py::handle argument);
  DepthView add_depth(py::handle argument, const DepthSettings& settings);

  std::vector<py::array> borrowed_;
  std::vector<Image> grey_;
  DepthImage depth_;
  FrameImages input_;
};

/// Samples of an IMU, one or arrays of N: times int or (N,), the others (3,) or (N, 3). TypeError,
/// ValueError for what is none.
std::vector<ImuSample> imu_samples(const py::object& timestamp_ns,
                                   const py::object& angular_velocity,
                                   const py::object& acceleration);

}  // namespace waymark::python

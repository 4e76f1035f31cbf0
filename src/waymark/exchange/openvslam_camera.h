// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"

namespace waymark {

/// A camera as files of OpenVSLAM and stella_vslam describe it, map files (.msg) and settings
/// alike.
struct OpenvslamCamera {
  std::string where;  ///< Begins error messages.
  std::string name;
  std::string model;  ///< perspective, fisheye, equirectangular or radial_division.
  std::string setup;  ///< monocular, stereo or RGBD.
  /// cols, rows, fx, fy, cx, cy, k1, ... as far as they are there.
  std::map<std::string, double, std::less<>> numbers;

  std::optional<double> find(std::string_view key) const;
  /// InputError where it is missing.
  double require(std::string_view key) const;
};

/// Models and set-ups are written "RadialDivision", "radial_division" and the like: letters and
/// digits in lower case.
std::string normalized_name(std::string_view name);

/// InputError unless it is one of monocular, stereo, RGBD.
Setup openvslam_setup(const OpenvslamCamera& camera);

/// The camera in our words. Of a stereo pair, which is rectified, camera 1 is the same camera
/// focal_x_baseline / fx to the right. InputError for what is missing or accepted by no model.
CameraChain openvslam_camchain(const OpenvslamCamera& camera);

/// The cameras of a settings file of OpenVSLAM or stella_vslam (YAML), in sections or with the flat
/// keys of 2019 and 2020 (`Camera.fx`), as a camchain. A StereoRectifier gives the two cameras as
/// they are, before rectification, which is not needed here. Notes say what was passed over.
/// Throws InputError with its line for what is missing, malformed or has no counterpart.
CameraChain read_openvslam_settings(const ConfigSource& source);

/// The cameras of a settings file of ORB-SLAM3 (its calibration tutorial of 2021: `Camera.type`,
/// `Camera1.fx`, `Stereo.T_c1_c2`, ...) or with the flat keys of its predecessors (`Camera.fx`,
/// `Camera.bf`), as a camchain. A pair that these rectify (`LEFT.K`, `RIGHT.K`) is taken as it is,
/// before rectification. Notes and errors as above.
CameraChain read_orbslam_settings(const ConfigSource& source);

}  // namespace waymark

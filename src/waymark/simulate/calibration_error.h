// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camchain.h"

namespace waymark {

/// By what a calibration that is told differs from the truth. Nothing: the truth is told.
struct CalibrationError {
  double focal = 1.0;       ///< Factor of the focal lengths, of all cameras.
  double centre_px = 0.0;   ///< Added to both coordinates of the principal points.
  double distortion = 1.0;  ///< Factor of the distortion coefficients; 0: none is told.
  /// By this rotation vector camera 1 is told turned about its own axes, in mrad.
  Eigen::Vector3d turn_mrad = Eigen::Vector3d::Zero();
  double baseline = 1.0;  ///< Factor of the distance of camera 1 from camera 0.
  double depth = 1.0;     ///< Factor of the units of the depth image per metre.
};

/// Reads "KEY=VALUE" each: focal, centre, distortion, turn_x, turn_y, turn_z, baseline, depth.
/// Throws InputError.
CalibrationError parse_calibration_error(const std::vector<std::string>& assignments);

/// The calibration that is told in place of the true one. Intrinsics are taken to end with fu fv pu
/// pv, as those of all models of the library do. Throws InputError for what the chain does not
/// have.
CameraChain told_chain(CameraChain truth, const CalibrationError& error);

}  // namespace waymark

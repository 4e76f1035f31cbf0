// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/imu/imu.h"

namespace waymark {

/// By what a calibration that is told differs from the truth. Nothing: the truth is told.
struct CalibrationError {
  double focal = 1.0;       ///< Factor of the focal lengths, of all cameras.
  double centre_px = 0.0;   ///< Added to both coordinates of the principal points.
  double distortion = 1.0;  ///< Factor of the distortion coefficients; 0: none is told.
  /// By this rotation vector camera 1 is told turned about its own axes, in mrad.
  Eigen::Vector3d turn_mrad = Eigen::Vector3d::Zero();
  double baseline = 1.0;      ///< Factor of the distance of camera 1 from camera 0.
  double depth = 1.0;         ///< Factor of the units of the depth image per metre.
  double imu_turn_deg = 0.0;  ///< The IMU is told turned by it about (1, 1, 1) of its own axes.
  double imu_lever_cm = 0.0;  ///< And so far away along these.
  double imu_shift_ms = 0.0;  ///< Added to the time shift of the IMU.
  bool is_imu_told = true;    ///< Otherwise there is nothing but samples.
};

/// Reads "KEY=VALUE" each: focal, centre, distortion, turn_x, turn_y, turn_z, baseline, depth,
/// imu_turn, imu_lever, imu_shift; and "imu=none". Throws InputError.
CalibrationError parse_calibration_error(const std::vector<std::string>& assignments);

/// The calibration that is told in place of the true one. Intrinsics are taken to end with fu fv pu
/// pv, as those of all models of the library do. Throws InputError for what the chain does not
/// have.
CameraChain told_chain(CameraChain truth, const CalibrationError& error);

/// What is told of an IMU of which all is known; nothing of none. Throws InputError where something
/// is to be told wrong of none.
ImuCalibration told_imu(ImuCalibration truth, const CalibrationError& error);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_report.h"

namespace waymark {

ImuCalibration InertialReport::calibration() const {
  constexpr double kToldRotation = 0.01;  // rad
  constexpr double kToldLeverArm_m = 0.02;
  constexpr double kToldTimeShift_s = 1e-3;
  ImuCalibration told;
  if (!is_used) return told;
  if (rotation_sigma_rad < kToldRotation && lever_arm_sigma_m < kToldLeverArm_m) {
    told.imu_from_rig = imu_from_rig;
  }
  if (time_shift_sigma_s < kToldTimeShift_s) told.time_shift_s = time_shift_s;
  return told;
}

}  // namespace waymark

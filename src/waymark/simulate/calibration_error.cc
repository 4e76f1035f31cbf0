// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/calibration_error.h"

#include <fmt/format.h>

#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr const char* kWhere = "calibration to tell";

double* number_of(CalibrationError& error, std::string_view key) {
  if (key == "focal") return &error.focal;
  if (key == "centre") return &error.centre_px;
  if (key == "distortion") return &error.distortion;
  if (key == "turn_x") return &error.turn_mrad.x();
  if (key == "turn_y") return &error.turn_mrad.y();
  if (key == "turn_z") return &error.turn_mrad.z();
  if (key == "baseline") return &error.baseline;
  if (key == "depth") return &error.depth;
  if (key == "imu_turn") return &error.imu_turn_deg;
  if (key == "imu_lever") return &error.imu_lever_cm;
  if (key == "imu_shift") return &error.imu_shift_ms;
  return nullptr;
}

void mistell(CameraDescription& camera, const CalibrationError& error) {
  for (double& coefficient : camera.distortion_coeffs) coefficient *= error.distortion;
  if (error.focal == 1.0 && error.centre_px == 0.0) return;
  if (camera.intrinsics.size() < 4) {
    throw InputError(kWhere,
                     fmt::format("camera model {} has neither focal length nor principal point, "
                                 "expected no focal and no centre",
                                 camera.camera_model));
  }
  double* const plane = camera.intrinsics.data() + camera.intrinsics.size() - 4;
  for (int axis = 0; axis < 2; ++axis) {
    plane[axis] *= error.focal;
    plane[2 + axis] += error.centre_px;
  }
}

}  // namespace

CalibrationError parse_calibration_error(const std::vector<std::string>& assignments) {
  CalibrationError error;
  for (const std::string& assignment : assignments) {
    if (assignment == "imu=none") {
      error.is_imu_told = false;
      continue;
    }
    const std::size_t equals = assignment.find('=');
    double* const number = number_of(error, std::string_view(assignment).substr(0, equals));
    const std::optional<double> value =
        equals == std::string::npos ? std::nullopt : parse_number(assignment.substr(equals + 1));
    if (number == nullptr || !value) {
      throw InputError(kWhere,
                       fmt::format("is {}, expected focal, centre, distortion, turn_x, turn_y, "
                                   "turn_z, baseline, depth, imu_turn, imu_lever or imu_shift, "
                                   "'=' and a number, or imu=none",
                                   quote_for_message(assignment)));
    }
    *number = *value;
  }
  return error;
}

CameraChain told_chain(CameraChain truth, const CalibrationError& error) {
  for (ChainCamera& camera : truth.cameras) mistell(camera.description, error);
  if (!error.turn_mrad.isZero() || error.baseline != 1.0) {
    if (truth.cameras.size() < 2) {
      throw InputError(kWhere, "there is one camera, expected neither turn nor baseline");
    }
    Rigid3& cam1_from_rig = truth.cameras[1].cam_from_rig;
    const Eigen::Vector3d centre_in_rig = error.baseline * cam1_from_rig.inverse().translation;
    cam1_from_rig.rotation = so3_exp(1e-3 * error.turn_mrad) * cam1_from_rig.rotation;
    cam1_from_rig.translation = -(cam1_from_rig.rotation * centre_in_rig);
  }
  if (truth.depth_factor) {
    *truth.depth_factor *= error.depth;
  } else if (error.depth != 1.0) {
    throw InputError(kWhere, "no depth is measured, expected no depth");
  }
  return truth;
}

ImuCalibration told_imu(ImuCalibration truth, const CalibrationError& error) {
  const bool is_right = error.is_imu_told && error.imu_turn_deg == 0.0 &&
                        error.imu_lever_cm == 0.0 && error.imu_shift_ms == 0.0;
  if (is_right) return truth;
  if (!truth.imu_from_rig || !truth.time_shift_s) {
    throw InputError(kWhere, "there is no IMU, expected nothing of one (--imu)");
  }
  if (!error.is_imu_told) return {};
  const Eigen::Vector3d diagonal = Eigen::Vector3d::Ones().normalized();
  const double turn_rad = error.imu_turn_deg * std::numbers::pi / 180.0;
  const Rigid3 told_from_true(so3_exp(turn_rad * diagonal), 1e-2 * error.imu_lever_cm * diagonal);
  truth.imu_from_rig = told_from_true * *truth.imu_from_rig;
  *truth.time_shift_s += 1e-3 * error.imu_shift_ms;
  return truth;
}

}  // namespace waymark

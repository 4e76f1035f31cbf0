// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "waymark/base/id.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"

namespace waymark {

/// What vision and an inertial measurement unit told of each other.
struct InertialReport {
  bool is_used = false;  ///< Whether vision agrees with it; the rest is nothing where it does not.
  std::string reason;    ///< Why it is not used; empty where it is.
  /// In mono from which frame on it told the unit of length; nothing where it did not, or where
  /// that is known otherwise.
  std::optional<FrameId> metric_from;
  SubmapId metric_submap;    ///< The part of the map that is in metres from then on.
  SubmapId submap;           ///< The part of the map that it was compared with.
  double scale_sigma = 0.0;  ///< Of the logarithm of metres per map unit.
  /// Acceleration of free fall in the frame of `submap`, m/s^2.
  Eigen::Vector3d gravity_in_world = Eigen::Vector3d::Zero();
  double gravity_sigma_rad = 0.0;   ///< Of its direction.
  double time_shift_s = 0.0;        ///< What is added to the time of an image for the IMU's clock.
  double time_shift_sigma_s = 0.0;  ///< Its standard deviation.
  Rigid3 imu_from_rig;              ///< In metres; the rig's frame is that of camera 0.
  double rotation_sigma_rad = 0.0;  ///< Of its rotation, about each axis.
  double lever_arm_sigma_m = 0.0;   ///< Of its translation, along each axis.
  ImuBiases biases;                 ///< At the end.

  /// As far as it is known as well as one that somebody states: to tell of the same IMU.
  ImuCalibration calibration() const;
};

}  // namespace waymark

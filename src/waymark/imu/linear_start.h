// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/imu/preintegration.h"

namespace waymark {

/// What preintegrations between neighbouring poses say; nothing where samples are missing.
using PreintegrationChain = std::vector<std::optional<Preintegration>>;

/// States and setup of all poses.
struct InertialUnknowns {
  std::vector<InertialState> states;
  InertialSetup setup;
};

/// Scale, gravity, velocities, lever arm and accelerometer bias, where the rotation imu_from_rig
/// and the gyroscope bias (of the preintegrations) are known: all linear in how the IMU moved
/// between poses (Martinelli 2014; Mur-Artal and Tardos 2017, section IV), by least
/// squares with priors. The size of gravity is a condition linearized at the direction found before
/// it. A scale that is not told is near the one of the options. imu_from_rig: its origin is what
/// the lever arm is believed to be, with this standard deviation.
InertialUnknowns linear_start(std::span<const VisionPose> poses,
                              const PreintegrationChain& chain,
                              const Rigid3& imu_from_rig,
                              double lever_arm_sigma,
                              const InertialStartOptions& options);

}  // namespace waymark

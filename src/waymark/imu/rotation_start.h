// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_start.h"

namespace waymark {

/// What rotations alone tell.
struct RotationStart {
  Eigen::Quaterniond imu_from_rig = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();  ///< rad/s.
  double time_shift_s = 0.0;
};

/// The rotation imu_from_rig and the bias that explain how the rig turned from pose to pose by how
/// the IMU did, from mean angular velocities (alignment of vectors, Umeyama 1991), robustly
/// (Huber). A time shift that is not told is where they agree best. What does not show remains as
/// told, or is near identity and 0. Nothing if no two neighbouring poses have all samples between
/// them.
std::optional<RotationStart> rotation_start(const ImuSamples& samples,
                                            std::span<const VisionPose> poses,
                                            const ImuCalibration& calibration,
                                            const ImuNoise& noise,
                                            const InertialStartOptions& options);

}  // namespace waymark

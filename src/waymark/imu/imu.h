// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Acceleration of free fall, m/s^2 (standard gravity, ISO 80000-3). It differs by 0.3 % on Earth.
inline constexpr double kStandardGravity = 9.80665;

/// What an inertial measurement unit measured at one moment, in its own frame.
struct ImuSample {
  std::int64_t timestamp_ns = 0;     ///< By the IMU's clock.
  Eigen::Vector3d angular_velocity;  ///< rad/s, with its bias.
  /// Specific force, m/s^2, with its bias: at rest g upwards (about 9.81), in free fall 0.
  Eigen::Vector3d acceleration;
};

/// White noise of both sensors and random walks of their biases, as Kalibr states them.
struct ImuNoise {
  double gyroscope = 0.0;           ///< rad/s/sqrt(Hz).
  double accelerometer = 0.0;       ///< m/s^2/sqrt(Hz).
  double gyroscope_walk = 0.0;      ///< rad/s^2/sqrt(Hz).
  double accelerometer_walk = 0.0;  ///< m/s^3/sqrt(Hz).
};

/// What the sensors show too much, in the frame of the IMU: measured = true + bias + noise.
struct ImuBiases {
  Eigen::Vector3d gyroscope = Eigen::Vector3d::Zero();      ///< rad/s.
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  ///< m/s^2.
};

/// Scale and misalignment of both sensors, as Kalibr models them: measured, but for bias and noise,
/// are gyroscope * turn + by_acceleration * push and accelerometer * push, where turn (rad/s) and
/// push (m/s^2) are the true ones in the axes of the IMU.
struct ImuIntrinsics {
  Eigen::Matrix3d gyroscope = Eigen::Matrix3d::Identity();      ///< Without unit.
  Eigen::Matrix3d by_acceleration = Eigen::Matrix3d::Zero();    ///< rad/s per m/s^2.
  Eigen::Matrix3d accelerometer = Eigen::Matrix3d::Identity();  ///< Without unit.
};

/// What is known of an IMU and of how it is mounted. What is not told is found.
struct ImuCalibration {
  std::optional<Rigid3> imu_from_rig;  ///< The rig's frame is that of camera 0.
  /// What is added to the time of an image to have it by the IMU's clock (Kalibr's
  /// timeshift_cam_imu).
  std::optional<double> time_shift_s;
  std::optional<ImuNoise> noise;  ///< Of its samples.
  /// What samples are corrected by when they are read.
  std::optional<ImuIntrinsics> intrinsics = {};
};

}  // namespace waymark

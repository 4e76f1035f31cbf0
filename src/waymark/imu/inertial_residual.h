// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/preintegration.h"

namespace waymark {

using Vector10d = Eigen::Matrix<double, 10, 1>;
using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15x10d = Eigen::Matrix<double, 15, 10>;
using Matrix25d = Eigen::Matrix<double, 25, 25>;

/// What a keyframe adds. Tangent vectors are (xi 6, velocity 3, gyroscope bias 3, accelerometer
/// bias 3), with exp(xi) on the left of rig_from_world.
struct InertialState {
  Rigid3 rig_from_world;  ///< In map units.
  /// Of the IMU in the axes of the world, m/s; at the end of the samples, not at the image, where
  /// the time shift has changed since.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  ImuBiases biases;

  /// Moved along a tangent vector.
  InertialState moved(const Vector15d& tangent) const;
};

/// What all keyframes share. Tangent vectors are (gravity 2, log scale 1, xi of imu_from_rig 6,
/// time shift 1); gravity turns about the axes across it that tangent_basis gives.
struct InertialSetup {
  /// Acceleration of free fall in the axes of the world, so downwards, m/s^2.
  Eigen::Vector3d gravity = {0.0, 0.0, -kStandardGravity};
  double log_scale = 0.0;  ///< Logarithm of metres per map unit.
  Rigid3 imu_from_rig;     ///< In metres.
  /// By how much the time shift is larger than the one that the samples were cut at, s.
  double time_shift_change_s = 0.0;

  /// Moved along a tangent vector.
  InertialSetup moved(const Vector10d& tangent) const;
};

/// Where the IMU is by a state, in metres: world_from_imu, in the axes of the world.
Rigid3 world_from_imu(const InertialState& state, const InertialSetup& setup);

/// What a preintegration contradicts two states by, whitened: in standard deviations. In the order
/// (rotation, velocity, position, walk of the gyroscope bias, walk of the accelerometer bias)
/// (Forster et al. 2017, section VI, eq. 45). With its derivatives by the tangent vectors.
struct InertialResidual {
  Vector15d value;
  Matrix15d by_first;
  Matrix15d by_second;
  Matrix15x10d by_setup;
};

/// The residual. A changed time shift d moves the IMU back along its motion from where the image
/// was taken to where the samples end, as if angular velocity (of the outermost samples) and
/// velocity (of the states) were constant in between: wrong by d^2 / 2 times the accelerations,
/// 5e-6 m for 1 ms and 10 m/s^2. Cut the samples anew where d gets larger.
InertialResidual inertial_residual(const Preintegration& preintegration,
                                   const InertialState& first,
                                   const InertialState& second,
                                   const InertialSetup& setup);

/// A state and how sure it is.
struct InertialEstimate {
  InertialState state;
  Matrix25d covariance = Matrix25d::Zero();  ///< Of the tangent vectors of (setup 10, state 15).
};

/// Where the rig is at end_ns by what it was at begin_ns (< end_ns, by the clock of the IMU, which
/// the setup does not change) and the samples between; nothing where these do not tell all of it.
/// The covariance is propagated to first order, with the noise and the walk of the biases.
std::optional<InertialEstimate> predict(const InertialEstimate& first,
                                        const ImuSamples& samples,
                                        std::int64_t begin_ns,
                                        std::int64_t end_ns,
                                        const ImuNoise& noise,
                                        const InertialSetup& setup);

}  // namespace waymark

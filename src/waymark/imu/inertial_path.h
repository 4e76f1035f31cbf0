// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_report.h"

namespace waymark {

/// Nothing is bridged for longer, whose errors grow beyond use.
inline constexpr std::int64_t kMaxBridgedNs = 10'000'000'000;

/// What vision and IMU tell together of a moment.
struct NavigationState {
  std::int64_t timestamp_ns = 0;  ///< By the clock of the images.
  Rigid3 world_from_rig;          ///< In metres.
  /// Of the IMU in the axes of the world, m/s.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  /// Of the pose, as that of a frame (tangent vectors xi = (rho, phi) of exp(xi) * rig_from_world,
  /// in m and rad), and the velocity.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  ImuBiases biases;  ///< At that moment.
};

/// The states in the order of time and, where samples tell all between two of them that are at
/// most 10 s apart, that of each sample there: integrated from the earlier one, with what is
/// missing to the later one spread evenly. report: of the same path. Covariances are those of the
/// earlier state.
std::vector<NavigationState> at_imu_rate(std::span<const NavigationState> states,
                                         const ImuSamples& samples,
                                         const InertialReport& report);

}  // namespace waymark

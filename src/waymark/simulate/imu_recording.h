// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/simulate/imu_device.h"
#include "waymark/simulate/motion.h"

namespace waymark {

/// A sample of a simulated IMU, and the truth at that moment.
struct RecordedImuSample {
  ImuSample sample;
  Rigid3 world_from_imu;
  Eigen::Vector3d velocity;            ///< Of the IMU in the world, m/s.
  Eigen::Vector3d gyroscope_bias;      ///< rad/s; in the sample.
  Eigen::Vector3d accelerometer_bias;  ///< m/s^2.
};

/// Recordings begin so long before the motion and end so long after it, as real ones do before the
/// first image and after the last.
inline constexpr double kImuLeadS = 0.5;

/// The samples of a whole motion, whose first moment is start_ns by the clock of the cameras. The
/// same seed gives the same errors whatever the motion.
std::vector<RecordedImuSample> record_imu(const ImuDevice& imu,
                                          const Motion& motion,
                                          std::int64_t start_ns,
                                          std::uint64_t seed);

}  // namespace waymark

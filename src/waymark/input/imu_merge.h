// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "waymark/imu/imu.h"

namespace waymark {

/// What one sensor of three axes measured at one moment.
struct SensorReading {
  std::int64_t timestamp_ns = 0;
  Eigen::Vector3d value;
};

/// Samples at the times of the gyroscope, in their order: the acceleration is interpolated linearly
/// between the readings before and after. Left out is what has none before or after, or where these
/// are further apart than three middle steps of the accelerometer and 50 ms.
std::vector<ImuSample> merge_imu(const std::vector<SensorReading>& gyroscope,
                                 std::vector<SensorReading> accelerometer);

}  // namespace waymark

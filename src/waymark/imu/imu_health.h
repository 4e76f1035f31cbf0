// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/imu/imu.h"

namespace waymark {

/// Whether one of the sensors of an IMU works.
struct SensorHealth {
  bool is_constant = false;  ///< All values are the same to the bit: it is not connected.
  /// Of samples at the end of the range, beyond which nothing is told.
  double saturated_share = 0.0;
};

/// What samples look like, whatever moved.
struct ImuHealth {
  double rate_hz = 0.0;  ///< By the median period.
  SensorHealth gyroscope;
  SensorHealth accelerometer;
};

/// samples: of ascending times. A value is at the end of the range if it is the largest of all axes
/// and stays there for two samples or more. That is asked of ranges from 2 rad/s and 15 m/s^2 on
/// only, which are narrower than any in use: below it, a still sensor with few bits looks the same.
ImuHealth imu_health(std::span<const ImuSample> samples);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/imu/imu.h"

namespace waymark {

/// Time without samples.
struct ImuGap {
  std::int64_t start_ns = 0;     ///< Time of the sample before it.
  std::int64_t duration_ns = 0;  ///< To the next one.
};

/// What one of the sensors of an IMU shows.
struct SensorHealth {
  double mean_length = 0.0;  ///< rad/s, or m/s^2.
  bool is_constant = false;  ///< All values are the same to the bit: it is not connected.
};

/// What samples look like, whatever moved.
struct ImuHealth {
  double rate_hz = 0.0;      ///< By the median step from sample to sample.
  double duration_s = 0.0;   ///< From the first to the last sample.
  std::vector<ImuGap> gaps;  ///< Steps of more than 2.5 median ones.
  SensorHealth gyroscope;
  SensorHealth accelerometer;
  double rest_s = 0.0;  ///< How long the IMU lay still, in pieces of a second.
  /// White noise while it lay still, by the Allan deviation (IEEE Std 952-1997, annex C) at a lag
  /// of 0.1 s, since filters hide noise at shorter ones. Walks are those by default. Nothing
  /// without three seconds of rest.
  std::optional<ImuNoise> noise;
};

/// samples: of ascending times.
ImuHealth imu_health(std::span<const ImuSample> samples);

/// Whether an IMU shows nothing but noise: it lies still, or goes straight on at a constant speed,
/// which no device on wheels or in the hand does. Not where they are the same to the bit, as of one
/// that is not connected. At least three samples.
bool shows_no_motion(std::span<const ImuSample> samples);

/// For an IMU that nothing is known of: twice the white noise of one as in phones and cheap cameras
/// (Bosch BMI160 data sheet: 0.007 deg/s/sqrt(Hz) and 180 ug/sqrt(Hz)), for vibration, scale and
/// misalignment, and the random walks of the Analog Devices ADIS16448 of EuRoC (Burri et al. 2016),
/// which hold what temperature does.
ImuNoise default_imu_noise();

/// White noise that samples show whatever the motion, which changes little from one to the next: by
/// the median of their second differences. Filters hide some of it, and what shakes the device
/// adds. Walks are 0. At least three samples.
ImuNoise shown_imu_noise(std::span<const ImuSample> samples);

}  // namespace waymark

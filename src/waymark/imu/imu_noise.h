// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"

namespace waymark {

/// For an IMU that nothing is known of: twice the white noise of one as in phones and cheap cameras
/// (Bosch BMI160 data sheet: 0.007 deg/s/sqrt(Hz) and 180 ug/sqrt(Hz)), for vibration, scale and
/// misalignment, and the random walks of the Analog Devices ADIS16448 of EuRoC (Burri et al. 2016),
/// which hold what temperature does.
ImuNoise default_imu_noise();

/// White noise as measured while the IMU lies still, by Allan deviations at lags of up to 0.1 s
/// (IEEE Std 952-1997, annex C); the largest, since filters hide noise at the shortest. Its walks
/// are those by default: a start is too short to tell them. Nothing without three seconds of rest.
std::optional<ImuNoise> estimate_imu_noise(const ImuSamples& samples);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "waymark/camera/camchain.h"
#include "waymark/imu/imu.h"
#include "waymark/simulate/imu_recording.h"

namespace waymark {

/// Samples as EuRoC's imu0/data.csv.
std::string format_imu_samples(std::span<const RecordedImuSample> samples);

/// The truth at each of the samples, by the clock of the IMU, as EuRoC's
/// state_groundtruth_estimate0/data.csv: pose of the IMU in the world, its velocity in the world,
/// biases in the frame of the IMU.
std::string format_imu_truth(std::span<const RecordedImuSample> samples);

/// The beginning of EuRoC's imu0/sensor.yaml, whose body is the rig; the rest is that of imu.yaml.
std::string format_imu_mounting(const Rigid3& imu_from_rig);

/// Kalibr's imu.yaml.
std::string format_imu_noise(const ImuNoise& noise, double rate_hz);

/// format_camchain() with T_cam_imu and timeshift_cam_imu of each camera, as far as they are told.
std::string format_camchain_imu(const CameraChain& chain, const ImuCalibration& told);

}  // namespace waymark

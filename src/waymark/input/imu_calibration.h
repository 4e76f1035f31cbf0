// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/imu/imu.h"

namespace waymark {

/// What a document in Kalibr's format says of the IMU: T_cam_imu and timeshift_cam_imu of cam0, and
/// the noise of the section imu0, which is all four numbers or none. Other keys of that are passed
/// over. A T_cam_imu that is no rigid motion is, too, with a line among the notes. Throws
/// InputError.
ImuCalibration read_imu_calibration(const ConfigNode& config, std::vector<std::string>& notes);

/// The noise that a map states by the four keys of Kalibr; nothing if it has none of them. key: of
/// the map, for errors. Throws InputError where one is missing or malformed.
std::optional<ImuNoise> read_imu_noise(const ConfigNode& node, const std::string& key);

/// Whether a document is Kalibr's imu.yaml, or sensor.yaml of an IMU of EuRoC: the value of imu0.
bool is_imu_document(const ConfigNode& config);

/// What `calibration` does not tell, as `other` has it.
void fill_in(ImuCalibration& calibration, const ImuCalibration& other);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/camera/camchain.h"
#include "waymark/imu/imu.h"

namespace waymark {

/// A camchain (format_camchain()) with T_cam_imu and timeshift_cam_imu of each camera, as Kalibr
/// has them, as far as they are told.
std::string format_camchain_imu(const CameraChain& chain, const ImuCalibration& told);

}  // namespace waymark

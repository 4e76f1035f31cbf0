// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "waymark/input/imu_stream.h"
#include "waymark/input/input.h"

namespace waymark {

/// Gives an input its inertial data, with a line on them: those of InputOptions::imu, else what
/// `carried` reads, if any. What the options say of the IMU takes the place of what these know.
/// Throws InputError for a file of the options; what the input carries and cannot be read is said
/// and left out, as no input needs it.
void take_imu(const InputOptions& options,
              const std::function<std::optional<ImuStream>()>& carried,
              InputInfo& info);

/// Of images that are turned clockwise by so many quarters: so is camera 0, the rig's frame.
void turn_imu(InputInfo& info, int num_quarters);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/report/run_folder.h"

namespace waymark {

/// What an IMU brought and what it is like, with speed and biases over time; empty without one.
std::string imu_section(const RunFolder& run);

}  // namespace waymark

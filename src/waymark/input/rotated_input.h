// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/input/input.h"

namespace waymark {

/// The same input with all images, masks and depth images turned clockwise by 90, 180 or 270
/// degrees, and the calibration with them. InputError for other angles, and for a camera model that
/// it cannot be told for.
std::unique_ptr<Input> rotate_input(std::unique_ptr<Input> input, int clockwise_deg);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/input/input.h"

namespace waymark {

/// The same input with images of camera 0 `width_px` wide, and all other images, masks, depth
/// images and the calibration by the same factor. Pixels are means over what they cover, of depth
/// images and masks the one in the middle. InputError unless that makes them smaller, and for a
/// camera model that it cannot be told for.
std::unique_ptr<Input> resize_input(std::unique_ptr<Input> input, int width_px);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/image/image_header.h"
#include "waymark/input/input.h"

namespace waymark {

/// The same input with images of camera 0 `width_px` wide, and all other images, masks, depth
/// images and the calibration by the same factor. Pixels are means over what they cover, of depth
/// images and masks the one in the middle. InputError unless that makes them smaller, and for a
/// camera model that it cannot be told for.
std::unique_ptr<Input> resize_input(std::unique_ptr<Input> input, int width_px);

/// How many times larger images of a size have to be for features to be found where they are: the
/// patch that describes one covers too much of a small image. 1 from 320x240 px on.
int enlargement_for(const ImageSize& size);

/// The same input with images larger by enlargement_for() those of camera 0, and masks, depth
/// images and the calibration with them: pixels between are interpolated (bilinear), those of depth
/// images and masks repeated. As it is for a camera model that it cannot be told for.
std::unique_ptr<Input> enlarge_if_small(std::unique_ptr<Input> input);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/image/image.h"

namespace waymark {

/// A part of the image in fractions of its size, 0..1.
struct MaskRectangle {
  double left = 0.0;
  double right = 0.0;
  double top = 0.0;
  double bottom = 0.0;
};

/// A mask that is 0 on the pixels whose centres are in a rectangle and 255 elsewhere. Throws
/// InputError where a rectangle is not 0 <= left <= right <= 1, 0 <= top <= bottom <= 1.
Image mask_of_rectangles(std::span<const MaskRectangle> rectangles, int width_px, int height_px);

}  // namespace waymark

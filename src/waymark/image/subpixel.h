// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/image/fast.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// From the centre of a pixel, in pixels of its level, -0.5..0.5.
struct SubpixelOffset {
  float x_px = 0.0f;
  float y_px = 0.0f;
};

/// Where the corner score peaks: top of the parabolas through the score of the corner and of its
/// neighbours in the row and in the column.
SubpixelOffset locate_peak(const PaddedImage& scores, const Corner& corner);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/image/fast.h"

namespace waymark {

/// From the centre of a pixel, in pixels of its level, -0.5..0.5.
struct SubpixelOffset {
  float x_px = 0.0f;
  float y_px = 0.0f;
};

/// Where the FAST score peaks: top of the paraboloid (six coefficients) that fits the scores of a
/// corner and of its 8 neighbours best in the sense of least squares.
SubpixelOffset locate_peak(const ScorePatch& scores);

}  // namespace waymark

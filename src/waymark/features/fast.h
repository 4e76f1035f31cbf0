// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "waymark/features/corner.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// Radius of the ring of 16 pixels that FAST looks at.
inline constexpr int kFastRadius = 3;

/// A rectangle of pixels.
struct Window {
  int x_px = 0;
  int y_px = 0;
  int width_px = 0;
  int height_px = 0;
};

/// FAST-9 score (Rosten & Drummond 2006) of each pixel of the window, which must be at least
/// kFastRadius from the border of the image: the largest contrast s such that 9 contiguous pixels
/// of the ring all differ from the centre by at least s and to the same side. Thus the pixel is a
/// corner in the sense of the paper at thresholds below s. The score is 0 where s <= min_contrast;
/// the larger that is, the faster this goes. scores gets the size of the window.
void fast_scores(const PaddedImage& image,
                 const Window& window,
                 int min_contrast,
                 PaddedImage& scores);

/// Scores of 3x3 pixels, row by row, none of them set to 0.
using ScorePatch = std::array<std::uint8_t, 9>;

/// Scores of the corners and of their neighbours, which must be at least kFastRadius from the
/// border of the image.
void fast_score_patches(const PaddedImage& image,
                        std::span<const Corner> corners,
                        std::span<ScorePatch> patches);

/// From the centre of a pixel, in pixels of its level, -0.5..0.5.
struct SubpixelOffset {
  float x_px = 0.0f;
  float y_px = 0.0f;
};

/// Where the FAST score peaks: top of the paraboloid (six coefficients) that fits the scores of a
/// corner and of its 8 neighbours best in the sense of least squares.
SubpixelOffset locate_peak(const ScorePatch& scores);

}  // namespace waymark

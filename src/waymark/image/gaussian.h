// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "waymark/image/padded_image.h"

namespace waymark {

/// Reused by gaussian_blur.
struct BlurWorkspace {
  void reserve(int width_px);

  std::vector<std::uint16_t> row;  ///< Blurred along columns, 8 fractional bits.
};

/// 7x7 Gaussian of sigma 2, mirrored at the borders (without repeating the outermost pixel), as
/// rotated BRIEF wants it. Rounds in such a way that it differs from the exact value by less than
/// 0.52. The image must be at least 4 pixels wide and high.
void gaussian_blur(const PaddedImage& source, BlurWorkspace& workspace, PaddedImage& result);

}  // namespace waymark

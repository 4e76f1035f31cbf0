// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "waymark/image/padded_image.h"

namespace waymark {

/// Rows in the making; reused.
struct DownscaleWorkspace {
  std::vector<std::int16_t> row;        ///< Interpolated between two rows, 7 fractional bits.
  std::vector<std::int16_t> weights;    ///< Of the right neighbour, 15 fractional bits.
  std::vector<std::uint8_t> with_gaps;  ///< Interpolated between columns; each sixth is void.
};

/// Bilinear interpolation at every 6/5 = 1.2 pixels: pixel j of the result is at 1.2 j + 0.1 of the
/// source, so that both images share their top left corner and weights repeat every 5 pixels.
/// The result has floor(5/6 of the size) pixels, all of them inside of the source.
void downscale(const PaddedImage& source, DownscaleWorkspace& workspace, PaddedImage& result);

}  // namespace waymark

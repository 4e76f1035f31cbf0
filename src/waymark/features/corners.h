// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "waymark/features/corner.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// Which corners to find.
struct CornerRequest {
  int border_px = 4;     ///< Nearest to the border of the image, at least kFastRadius + 1.
  int min_contrast = 7;  ///< Scores are larger.
  double density = 0.0;  ///< How many are needed per pixel.
};

/// Scores in the making; reused.
struct CornerWorkspace {
  PaddedImage band;
  PaddedImage tile;
};

/// Contrast of a corner that noise and a change of view do not easily move or remove.
inline constexpr int kStrongContrast = 20;

/// The largest number of corners that find_corners can find: no two of them are neighbours.
inline std::size_t max_num_corners(int width_px, int height_px) {
  return static_cast<std::size_t>(width_px / 2 + 1) * static_cast<std::size_t>(height_px / 2 + 1);
}

/// Pixels none of whose 8 neighbours has a larger FAST score; of equal neighbours the last in
/// raster order wins. The image is divided into tiles. One that holds as many strong corners as are
/// needed gives only these; elsewhere all corners above the minimum contrast count, so that poor
/// texture is used where there is no better. Goes tile by tile; the order depends on nothing but
/// the size of the image. The result lives in buffer, whose size never shrinks.
std::span<Corner> find_corners(const PaddedImage& image,
                               const CornerRequest& request,
                               CornerWorkspace& workspace,
                               std::vector<Corner>& buffer);

}  // namespace waymark

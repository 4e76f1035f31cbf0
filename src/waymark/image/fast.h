// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/image/padded_image.h"

namespace waymark {

/// A local maximum of the corner score at a pixel of one level.
struct Corner {
  std::uint16_t x_px = 0;
  std::uint16_t y_px = 0;
  std::uint8_t score = 0;

  friend bool operator==(const Corner&, const Corner&) = default;
};

/// Radius of the ring of 16 pixels that FAST looks at.
inline constexpr int kFastRadius = 3;

/// FAST-9 score (Rosten & Drummond 2006) of each pixel that is at least margin_px >= 3 from the
/// border: the largest contrast s such that 9 contiguous pixels of the ring all differ from the
/// centre by at least s and to the same side. Thus the pixel is a corner in the sense of the paper
/// at thresholds below s. The score is 0 where s <= min_contrast, and unspecified nearer to the
/// border. Needs no threshold search: one pass knows all the corners.
void fast_scores(const PaddedImage& image, int margin_px, int min_contrast, PaddedImage& scores);

/// The same for one pixel; defines it.
int fast_score_reference(ImageView image, int x, int y);

/// The largest number of corners that find_corners can find: no two of them are neighbours.
inline std::size_t max_num_corners(int width_px, int height_px) {
  return static_cast<std::size_t>(width_px / 2 + 1) * static_cast<std::size_t>(height_px / 2 + 1);
}

/// Pixels with a score above min_contrast, none of whose 8 neighbours has a larger one (of equal
/// neighbours the last in raster order wins), at least margin_px + 1 from the border, in raster
/// order. The result lives in buffer, whose size never shrinks.
std::span<Corner> find_corners(const PaddedImage& scores,
                               int margin_px,
                               int min_contrast,
                               std::vector<Corner>& buffer);

}  // namespace waymark

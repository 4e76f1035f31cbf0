// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

// First pixel whose centre is not before the fraction of the size.
int first_pixel(double fraction, int size) {
  return static_cast<int>(std::ceil(fraction * size - 0.5));
}

}  // namespace

Image mask_of_rectangles(std::span<const MaskRectangle> rectangles, int width_px, int height_px) {
  Image mask(width_px, height_px);
  std::fill(mask.values.begin(), mask.values.end(), std::uint8_t{255});
  for (const MaskRectangle& part : rectangles) {
    const auto is_range = [](double low, double high) {
      return 0.0 <= low && low <= high && high <= 1.0;
    };
    if (!is_range(part.left, part.right) || !is_range(part.top, part.bottom)) {
      throw InputError("mask rectangle",
                       fmt::format("left {} right {} top {} bottom {}, expected fractions of the "
                                   "image, 0 <= left <= right <= 1 and 0 <= top <= bottom <= 1",
                                   part.left,
                                   part.right,
                                   part.top,
                                   part.bottom));
    }
    const int left = std::min(first_pixel(part.left, width_px), width_px);
    const int right = std::min(first_pixel(part.right, width_px), width_px);
    const int bottom = std::min(first_pixel(part.bottom, height_px), height_px);
    for (int y = first_pixel(part.top, height_px); y < bottom; ++y) {
      std::fill(mask.row(y) + left, mask.row(y) + right, std::uint8_t{0});
    }
  }
  return mask;
}

}  // namespace waymark

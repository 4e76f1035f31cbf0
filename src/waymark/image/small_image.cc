// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/small_image.h"

#include <algorithm>

#include "waymark/image/convert.h"

namespace waymark {

double small_image_factor(int width_px, int height_px) {
  constexpr int kMaxSizePx = 80;
  const int side_px = std::max(width_px, height_px);
  return 1.0 / ((side_px + kMaxSizePx - 1) / kMaxSizePx);
}

SmallImage make_small_image(ImageView image, ImageView mask) {
  SmallImage small;
  const double factor = small_image_factor(image.width_px, image.height_px);
  small.grey = reduce(image, factor);
  if (!mask.is_empty()) small.mask = pick_reduced(mask, factor);
  return small;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/small_image.h"

#include <algorithm>

#include "waymark/image/convert.h"

namespace waymark {

namespace {

/// Of whole squares.
double factor_to(int max_size_px, int width_px, int height_px) {
  const int side_px = std::max(width_px, height_px);
  return 1.0 / ((side_px + max_size_px - 1) / max_size_px);
}

}  // namespace

double small_image_factor(int width_px, int height_px) {
  return factor_to(80, width_px, height_px);
}

double detail_factor(int width_px, int height_px) { return factor_to(320, width_px, height_px); }

SmallImage make_small_image(ImageView image, ImageView mask) {
  SmallImage small;
  const double factor = small_image_factor(image.width_px, image.height_px);
  small.grey = reduce(image, factor);
  if (!mask.is_empty()) small.mask = pick_reduced(mask, factor);
  small.detail = reduce(image, detail_factor(image.width_px, image.height_px));
  return small;
}

}  // namespace waymark

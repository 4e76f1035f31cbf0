// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/seam_padding.h"

#include <algorithm>

#include "waymark/base/check.h"

namespace waymark {
namespace {

void resize(Image& image, int width_px, int height_px) {
  if (image.width_px != width_px || image.height_px != height_px) image = {width_px, height_px};
}

}  // namespace

ImageView SeamPadding::widen(ImageView image) {
  WAYMARK_CHECK(margin_px_ >= 0 && margin_px_ <= image.width_px);
  resize(image_, image.width_px + 2 * margin_px_, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    const std::uint8_t* const row = image.row(y);
    std::uint8_t* next =
        std::copy(row + image.width_px - margin_px_, row + image.width_px, image_.row(y));
    next = std::copy(row, row + image.width_px, next);
    std::copy(row, row + margin_px_, next);
  }
  return image_.view();
}

ImageView SeamPadding::widen_mask(ImageView mask,
                                  int width_px,
                                  int height_px,
                                  std::uint8_t otherwise) {
  resize(mask_, width_px + 2 * margin_px_, height_px);
  std::fill(mask_.values.begin(), mask_.values.end(), std::uint8_t{0});
  for (int y = 0; y < height_px; ++y) {
    std::uint8_t* const row = mask_.row(y) + margin_px_;
    if (mask.is_empty()) {
      std::fill(row, row + width_px, otherwise);
    } else {
      std::copy(mask.row(y), mask.row(y) + width_px, row);
    }
  }
  return mask_.view();
}

}  // namespace waymark

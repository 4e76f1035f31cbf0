// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/pyramid.h"

#include <algorithm>

namespace waymark {

void Pyramid::build(ImageView image) {
  levels_[0].resize(image.width_px, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    std::copy_n(image.row(y), image.width_px, levels_[0].row(y));
  }
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    downscale(levels_[i - 1], workspace_, levels_[i]);
  }
}

}  // namespace waymark

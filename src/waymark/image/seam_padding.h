// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/image/image.h"

namespace waymark {

/// Takes the seam out of 360 degree images: repeats columns at both sides, so that what lies across
/// the seam is found and described like everything else. Keeps its buffers.
class SeamPadding {
 public:
  /// margin_px: columns at either side, at most the width.
  explicit SeamPadding(int margin_px) : margin_px_(margin_px) {}

  int margin_px() const { return margin_px_; }

  /// The image, margin_px wider at both sides. Stays valid until the next call.
  ImageView widen(ImageView image);

  /// The mask of the widened image: 0 in the margins, where everything is seen a second time. An
  /// empty mask is one of `otherwise` all over an image of this size.
  ImageView widen_mask(ImageView mask, int width_px, int height_px, std::uint8_t otherwise);

 private:
  int margin_px_;
  Image image_;
  Image mask_;
};

}  // namespace waymark

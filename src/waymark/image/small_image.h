// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/image/image.h"

namespace waymark {

/// A frame's image at no more than 80 pixels to a side, from which whole images are compared (Klein
/// and Murray 2008: small blurry images), and at no more than 320, from which patches are.
struct SmallImage {
  Image grey;    ///< Means over these squares; incomplete ones are left out.
  Image mask;    ///< 0 where the frame is not looked at. Empty: it is everywhere.
  Image detail;  ///< Means over smaller squares. Empty: there is none.
};

/// Its size as part of that of an image.
double small_image_factor(int width_px, int height_px);
/// That of `detail`.
double detail_factor(int width_px, int height_px);

/// mask: empty or of the size of the image.
SmallImage make_small_image(ImageView image, ImageView mask);

}  // namespace waymark

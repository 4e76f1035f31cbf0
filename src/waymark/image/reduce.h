// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/image/image.h"

namespace waymark {

/// An image made smaller by a factor below 1: each pixel is the mean of the area that it covers.
/// The size is rounded down, the corner stays where it is.
Image reduce(ImageView image, double factor);

/// The same where values must not be mixed: the pixel in the middle of the area.
Image pick_reduced(ImageView image, double factor);
DepthImage pick_reduced(DepthView image, double factor);

}  // namespace waymark

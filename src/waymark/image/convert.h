// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Grey values of colour, and fewer pixels.
//
//   const ColorImage color(1280, 960);
//   const Image grey = to_grey(color.view());
//   const Image half = reduce(grey.view(), 2.0);

#include <array>
#include <cstdint>

#include "waymark/image/image.h"
#include "waymark/image/settings.h"

namespace waymark {

using Rgb = std::array<std::uint8_t, 3>;  ///< Red, green, blue.
using ColorView = BasicImageView<Rgb>;    ///< A borrowed image in colour.
using ColorImage = BasicImage<Rgb>;       ///< An image in colour.

/// The luma of ITU-R BT.601, 0.299 R + 0.587 G + 0.114 B, rounded; bit by bit what OpenCV makes of
/// such an image.
Image to_grey(const ColorView& image);

/// Depth in metres in the units of the settings, rounded. 0, no measurement, where it is not
/// positive and finite or more than the units can say (65535 of them).
DepthImage depth_in_units(const BasicImageView<float>& depth_m, const DepthSettings& settings);

/// An image made smaller by a factor below 1: each pixel is the mean of the area that it covers.
/// The size is rounded down, the corner stays where it is.
Image reduce(ImageView image, double factor);

/// The same where values must not be mixed: the pixel in the middle of the area.
Image pick_reduced(ImageView image, double factor);
/// The same of depth.
DepthImage pick_reduced(BasicImageView<std::uint16_t> image, double factor);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/image/image.h"

namespace waymark {

/// What an image is like, whatever it shows: for people who ask why nothing was found in it.
struct ImageStatistics {
  std::uint8_t brightness = 0;    ///< Mean grey value.
  std::uint8_t contrast = 0;      ///< Standard deviation of the grey values.
  std::uint8_t blur_percent = 0;  ///< See measure_image(); 100: nothing is left to smear.
  bool is_known = false;          ///< Whether there was an image to measure.
};

/// Measures rows and columns spread over the image, of pixels of 2 x 2 so that noise counts less.
///
/// The blur is that of Crete et al. (2007), "The blur effect": the part of the differences between
/// neighbours along a line that a mean over 9 of them leaves; of rows and columns the larger, as
/// motion smears in one direction. Images without blur have 20 to 45 %. Nothing is known of an
/// image with less than 24 pixels to a side.
ImageStatistics measure_image(ImageView image);

}  // namespace waymark

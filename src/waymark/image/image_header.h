// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/image/image.h"

namespace waymark {

// What can be said of the bytes of an image file before they are decoded.

/// Width and height of an image.
struct ImageSize {
  int width_px = 0;   ///< Columns.
  int height_px = 0;  ///< Rows.

  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// The size of an image in memory.
template <class T>
ImageSize size_of(const BasicImage<T>& image) {
  return {image.width_px, image.height_px};
}

/// Larger images are refused by what their header says, before there is memory for them:
/// 16384x8192, twice what the largest 360 degree cameras have, are within.
inline constexpr int kMaxMegapixels = 135;
/// The longest side that a JPEG has.
inline constexpr int kMaxSidePx = 65500;

/// Whether an image of this size is refused.
inline bool is_too_large(const ImageSize& size) {
  return 1e-6 * size.width_px * size.height_px > kMaxMegapixels || size.width_px > kMaxSidePx ||
         size.height_px > kMaxSidePx;
}

/// The size that the header of a PNG, JPEG, TIFF, BMP, WebP, PGM or PPM states, from 1x1 on.
/// Nothing for other files.
std::optional<ImageSize> size_in_header(std::string_view bytes);

/// Whether the bytes begin as a PNG file does.
bool is_png(std::string_view bytes);

/// The PNG file of those chunks alone that make up the pixels (ISO/IEC 15948), transparency not
/// among them. Nothing when a chunk is damaged or the end is missing.
std::optional<std::string> pixels_of_png(std::string_view bytes);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include "waymark/image/image.h"
#include "waymark/image/padded_image.h"

namespace waymark::testing {

/// Overlapping rectangles of random grey with a little noise: corners of any contrast. Sides are
/// multiples of size_px.
inline PaddedImage make_texture(int width_px, int height_px, std::uint64_t seed, int size_px = 1) {
  std::mt19937_64 random(seed);
  const auto below = [&](int end) {
    return static_cast<int>(random() % static_cast<std::uint64_t>(end));
  };
  PaddedImage image;
  image.resize(width_px, height_px);
  for (int y = 0; y < height_px; ++y) std::fill_n(image.row(y), image.stride(), 100);
  for (int i = 0; i < width_px * height_px / (200 * size_px * size_px); ++i) {
    const int left = below(width_px);
    const int top = below(height_px);
    const int right = std::min(left + size_px * (3 + below(30)), width_px);
    const int bottom = std::min(top + size_px * (3 + below(30)), height_px);
    const auto grey = static_cast<std::uint8_t>(below(256));
    for (int y = top; y < bottom; ++y) std::fill(image.row(y) + left, image.row(y) + right, grey);
  }
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::clamp(image.row(y)[x] + below(9) - 4, 0, 255));
    }
  }
  return image;
}

/// Independent random grey values.
inline PaddedImage make_noise(int width_px, int height_px, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  PaddedImage image;
  image.resize(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random());
  }
  return image;
}

}  // namespace waymark::testing

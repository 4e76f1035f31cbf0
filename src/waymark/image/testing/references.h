// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "waymark/image/orientation.h"
#include "waymark/image/padded_image.h"

/// What the kernels of this module compute, one pixel at a time: these define their results bit by
/// bit.
namespace waymark {

inline void gaussian_blur_reference(const PaddedImage& source, PaddedImage& result) {
  // exp(-x^2 / (2 sigma^2)) of distance 0..3, normalised to a sum of 256 over the 7 taps.
  constexpr std::array<int, 4> kTaps{56, 48, 34, 18};
  constexpr int kRadius = 3;
  constexpr int kRounding = 128 + 2;  // A half, and the mean of what four truncations have lost.
  const auto mirrored = [](int i, int size) {
    if (i < 0) return -i;
    return i < size ? i : 2 * size - 2 - i;
  };
  const int width = source.width_px();
  const int height = source.height_px();
  result.resize(width, height);
  for (int y = 0; y < height; ++y) {
    const auto column_sum = [&](int x) {
      int sum = kTaps[0] * source.row(y)[x];
      for (int i = 1; i <= kRadius; ++i) {
        sum += kTaps[static_cast<std::size_t>(i)] *
               (source.row(mirrored(y - i, height))[x] + source.row(mirrored(y + i, height))[x]);
      }
      return sum;
    };
    for (int x = 0; x < width; ++x) {
      int sum = kRounding + ((column_sum(x) * kTaps[0]) >> 8);
      for (int i = 1; i <= kRadius; ++i) {
        const int left = column_sum(mirrored(x - i, width));
        const int right = column_sum(mirrored(x + i, width));
        sum += (((left + right + 1) >> 1) * kTaps[static_cast<std::size_t>(i)]) >> 7;
      }
      result.row(y)[x] = static_cast<std::uint8_t>(sum >> 8);
    }
  }
}

inline void downscale_reference(const PaddedImage& source, PaddedImage& result) {
  // Weight of the second of two neighbours, 15 fractional bits.
  constexpr std::array<int, 5> kWeights{3277, 9830, 16384, 22938, 29491};
  const auto interpolate = [](int a, int b, int weight) {
    return a + (((b - a) * weight + 16384) >> 15);
  };
  result.resize(source.width_px() * 5 / 6, source.height_px() * 5 / 6);
  for (int y = 0; y < result.height_px(); ++y) {
    const std::uint8_t* above = source.row(y / 5 * 6 + y % 5);
    const std::uint8_t* below = above + source.stride();
    const int weight_below = kWeights[static_cast<std::size_t>(y % 5)];
    for (int x = 0; x < result.width_px(); ++x) {
      const int x0 = x / 5 * 6 + x % 5;
      const int left = interpolate(above[x0] << 7, below[x0] << 7, weight_below);
      const int right = interpolate(above[x0 + 1] << 7, below[x0 + 1] << 7, weight_below);
      const int value = interpolate(left, right, kWeights[static_cast<std::size_t>(x % 5)]);
      result.row(y)[x] = static_cast<std::uint8_t>((value + 64) >> 7);
    }
  }
}

inline float orientation_reference(ImageView image, int x, int y) {
  // Half the width of the disc at each distance from its middle row.
  constexpr std::array<int, kOrientationRadius + 1> kHalfWidths{
      15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};
  int moment_x = 0;
  int moment_y = 0;
  for (int v = -kOrientationRadius; v <= kOrientationRadius; ++v) {
    const int half_width = kHalfWidths[static_cast<std::size_t>(std::abs(v))];
    for (int u = -half_width; u <= half_width; ++u) {
      moment_x += u * image.at(x + u, y + v);
      moment_y += v * image.at(x + u, y + v);
    }
  }
  return std::atan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
}

/// The largest contrast at which a pixel is a corner, see fast_scores().
inline int fast_score_reference(ImageView image, int x, int y) {
  constexpr int kArc = 9;
  // Clockwise from below.
  constexpr std::array<int, 16> kX{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr std::array<int, 16> kY{3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  const int centre = image.at(x, y);
  int score = 0;
  for (int start = 0; start < 16; ++start) {
    int brighter = 255;
    int darker = 255;
    for (int i = start; i < start + kArc; ++i) {
      const auto at = static_cast<std::size_t>(i % 16);
      const int difference = image.at(x + kX[at], y + kY[at]) - centre;
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    score = std::max({score, brighter, darker});
  }
  return score;
}

}  // namespace waymark

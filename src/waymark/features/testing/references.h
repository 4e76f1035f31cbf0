// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "waymark/features/brief_pattern.h"
#include "waymark/features/features.h"
#include "waymark/image/image.h"
#include "waymark/image/padded_image.h"

/// What the vector code of this module has to give bit by bit, one pixel at a time.
namespace waymark::testing {

/// FAST-9 score of one pixel, by its definition.
inline int fast_score(ImageView image, int x, int y) {
  constexpr int kRing[16][2] = {{0, 3},
                                {1, 3},
                                {2, 2},
                                {3, 1},
                                {3, 0},
                                {3, -1},
                                {2, -2},
                                {1, -3},
                                {0, -3},
                                {-1, -3},
                                {-2, -2},
                                {-3, -1},
                                {-3, 0},
                                {-3, 1},
                                {-2, 2},
                                {-1, 3}};
  const int centre = image.at(x, y);
  int score = 0;
  for (int start = 0; start < 16; ++start) {
    int brighter = 255;
    int darker = 255;
    for (int i = start; i < start + 9; ++i) {
      const int difference = image.at(x + kRing[i % 16][0], y + kRing[i % 16][1]) - centre;
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    score = std::max({score, brighter, darker});
  }
  return score;
}

/// Angle in rad to the intensity centroid of the disc of 31 pixels around a pixel.
inline float orientation(ImageView image, int x, int y) {
  constexpr int kHalfWidths[] = {15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};
  int moment_x = 0;
  int moment_y = 0;
  for (int v = -15; v <= 15; ++v) {
    const int half_width = kHalfWidths[std::abs(v)];
    for (int u = -half_width; u <= half_width; ++u) {
      moment_x += u * image.at(x + u, y + v);
      moment_y += v * image.at(x + u, y + v);
    }
  }
  return std::atan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
}

/// Descriptor of one pixel, test by test, in fixed point: 15 fractional bits of sine and cosine, 10
/// of the coordinates.
inline Descriptor descriptor(ImageView smooth, int x, int y, float angle_rad) {
  const int cos = static_cast<int>(std::lround(std::cos(angle_rad) * 32767.0f));
  const int sin = static_cast<int>(std::lround(std::sin(angle_rad) * 32767.0f));
  const auto times = [](int a, int b) { return (a * b + (1 << 14)) >> 15; };
  const auto grey = [&](int px, int py) {
    const int u = times(px * 1024, cos) - times(py * 1024, sin);
    const int v = times(px * 1024, sin) + times(py * 1024, cos);
    return smooth.at(x + ((u + 512) >> 10), y + ((v + 512) >> 10));
  };
  Descriptor result{};
  for (std::size_t i = 0; i < kBriefPattern.size(); ++i) {
    const BriefTest& test = kBriefPattern[i];
    const bool is_darker = grey(test.x0, test.y0) < grey(test.x1, test.y1);
    result[i / 64] |= static_cast<std::uint64_t>(is_darker) << (i % 64);
  }
  return result;
}

inline void gaussian_blur(const PaddedImage& source, PaddedImage& result) {
  constexpr int kTaps[] = {56, 48, 34, 18};
  const int width = source.width_px();
  const int height = source.height_px();
  const auto mirrored = [](int i, int size) {
    return i < 0 ? -i : (i < size ? i : 2 * size - 2 - i);
  };
  result.resize(width, height);
  for (int y = 0; y < height; ++y) {
    const auto column_sum = [&](int x) {
      int sum = kTaps[0] * source.row(y)[x];
      for (int i = 1; i <= 3; ++i) {
        sum += kTaps[i] *
               (source.row(mirrored(y - i, height))[x] + source.row(mirrored(y + i, height))[x]);
      }
      return sum;
    };
    for (int x = 0; x < width; ++x) {
      int sum = 130 + ((column_sum(x) * kTaps[0]) >> 8);
      for (int i = 1; i <= 3; ++i) {
        const int left = column_sum(mirrored(x - i, width));
        const int right = column_sum(mirrored(x + i, width));
        sum += (((left + right + 1) >> 1) * kTaps[i]) >> 7;
      }
      result.row(y)[x] = static_cast<std::uint8_t>(sum >> 8);
    }
  }
}

inline void downscale(const PaddedImage& source, PaddedImage& result) {
  constexpr int kWeights[] = {3277, 9830, 16384, 22938, 29491};  // 0.1, 0.3, ... of 2^15.
  const auto interpolate = [](int a, int b, int weight) {
    return a + (((b - a) * weight + 16384) >> 15);
  };
  result.resize(source.width_px() * 5 / 6, source.height_px() * 5 / 6);
  for (int y = 0; y < result.height_px(); ++y) {
    const std::uint8_t* above = source.row(y / 5 * 6 + y % 5);
    const std::uint8_t* below = above + source.stride();
    for (int x = 0; x < result.width_px(); ++x) {
      const int x0 = x / 5 * 6 + x % 5;
      const int left = interpolate(above[x0] << 7, below[x0] << 7, kWeights[y % 5]);
      const int right = interpolate(above[x0 + 1] << 7, below[x0 + 1] << 7, kWeights[y % 5]);
      const int value = interpolate(left, right, kWeights[x % 5]);
      result.row(y)[x] = static_cast<std::uint8_t>((value + 64) >> 7);
    }
  }
}

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "waymark/image/image.h"

namespace waymark {

/// The grey value between the centres of pixels; those of the border go on outwards, or at the
/// other side where the image wraps around.
inline float sample(const Image& image, const Eigen::Vector2d& pixel, bool wraps) {
  const double left = std::floor(pixel.x());
  const double top = std::floor(pixel.y());
  const auto x = static_cast<float>(pixel.x() - left);
  const auto y = static_cast<float>(pixel.y() - top);
  const int width = image.width_px;
  const auto column = [&](int at) {
    return wraps ? (at + width) % width : std::clamp(at, 0, width - 1);
  };
  const int x0 = column(static_cast<int>(left));
  const int x1 = column(static_cast<int>(left) + 1);
  const std::uint8_t* const above = image.row(std::max(static_cast<int>(top), 0));
  const std::uint8_t* const below =
      image.row(std::min(static_cast<int>(top) + 1, image.height_px - 1));
  return (1.0f - y) * ((1.0f - x) * above[x0] + x * above[x1]) +
         y * ((1.0f - x) * below[x0] + x * below[x1]);
}

}  // namespace waymark

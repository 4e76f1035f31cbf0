// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace waymark {

/// A borrowed image: rows of width_px values, stride values apart. Row-major, single channel.
template <class T>
struct BasicImageView {
  const T* data = nullptr;
  int width_px = 0;
  int height_px = 0;
  std::ptrdiff_t stride = 0;  ///< In values, not bytes.

  const T* row(int y) const { return data + y * stride; }
  T at(int x, int y) const { return row(y)[x]; }
  bool is_empty() const { return data == nullptr || width_px <= 0 || height_px <= 0; }
};

using ImageView = BasicImageView<std::uint8_t>;  ///< Grey values.
using DepthView =
    BasicImageView<std::uint16_t>;  ///< Depth along z in units of the sensor; 0: none.

/// An image that owns its rows; stride is the width.
template <class T>
struct BasicImage {
  std::vector<T> values;
  int width_px = 0;
  int height_px = 0;

  BasicImage() = default;
  BasicImage(int width, int height)
      : values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        width_px(width),
        height_px(height) {}

  T* row(int y) { return values.data() + static_cast<std::ptrdiff_t>(y) * width_px; }
  const T* row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y) * width_px; }
  BasicImageView<T> view() const { return {values.data(), width_px, height_px, width_px}; }
};

using Image = BasicImage<std::uint8_t>;
using DepthImage = BasicImage<std::uint16_t>;

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.h"

namespace waymark {

/// An image that owns its rows, each followed by at least kPadding values that vector kernels may
/// read and write. Keeps its memory when it gets smaller.
class PaddedImage {
 public:
  static constexpr int kPadding = 64;

  /// Contents are unspecified afterwards.
  void resize(int width_px, int height_px) {
    width_px_ = width_px;
    height_px_ = height_px;
    stride_ = (width_px + 2 * kPadding - 1) / kPadding * kPadding;
    const auto size = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_px);
    if (values_.size() < size) values_.resize(size);
  }

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  std::ptrdiff_t stride() const { return stride_; }
  std::uint8_t* row(int y) { return values_.data() + y * stride_; }
  const std::uint8_t* row(int y) const { return values_.data() + y * stride_; }
  ImageView view() const { return {values_.data(), width_px_, height_px_, stride_}; }

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  std::ptrdiff_t stride_ = 0;
  std::vector<std::uint8_t> values_;
};

}  // namespace waymark

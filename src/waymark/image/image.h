// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images, owned or borrowed, and what a rig sees at one moment.
//
//   const Image left(640, 480), right(640, 480);
//   FrameImages moment;
//   moment.timestamp_ns = 1'000'000'000;
//   moment.image0 = left.view();
//   moment.image1 = right.view();
//   const TrackingResult& result = system.feed(moment);

#include <cstddef>
#include <cstdint>
#include <vector>

namespace waymark {

/// A borrowed image: rows of width_px values, stride values apart. Row-major, single channel.
template <class T>
struct BasicImageView {
  const T* data = nullptr;    ///< The first value of the top row.
  int width_px = 0;           ///< Columns.
  int height_px = 0;          ///< Rows.
  std::ptrdiff_t stride = 0;  ///< In values, not bytes.

  /// The first value of a row; y in [0, height_px).
  const T* row(int y) const { return data + y * stride; }
  /// The value at column x of row y, unchecked.
  T at(int x, int y) const { return row(y)[x]; }
  /// Whether there is no image.
  bool is_empty() const { return data == nullptr || width_px <= 0 || height_px <= 0; }
};

using ImageView = BasicImageView<std::uint8_t>;  ///< Grey values.
using DepthView =
    BasicImageView<std::uint16_t>;  ///< Depth along z in units of the sensor; 0: none.

/// An image that owns its rows; stride is the width.
template <class T>
struct BasicImage {
  std::vector<T> values;  ///< Row-major, height_px * width_px of them.
  int width_px = 0;       ///< Columns.
  int height_px = 0;      ///< Rows.

  BasicImage() = default;
  /// All values 0.
  BasicImage(int width, int height)
      : values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        width_px(width),
        height_px(height) {}

  /// The first value of a row; y in [0, height_px).
  T* row(int y) { return values.data() + static_cast<std::ptrdiff_t>(y) * width_px; }
  /// The first value of a row; y in [0, height_px).
  const T* row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y) * width_px; }
  /// Borrows the image: valid until it is resized, moved or destroyed.
  BasicImageView<T> view() const { return {values.data(), width_px, height_px, width_px}; }
};

using Image = BasicImage<std::uint8_t>;        ///< Grey values.
using DepthImage = BasicImage<std::uint16_t>;  ///< Depth along z in units of the sensor; 0: none.

/// The images of one moment. Views are borrowed for the duration of the call.
struct FrameImages {
  std::int64_t timestamp_ns = 0;  ///< Increases from frame to frame.
  ImageView image0 = {};          ///< Camera 0, grey, of the size its calibration states.
  ImageView image1 = {};          ///< Camera 1 of a stereo rig; empty otherwise.
  DepthView depth = {};  ///< Depth along z registered to camera 0; empty where there is none.
  ImageView mask = {};   ///< Of camera 0; no features where it is 0. Empty: everything is used.
  std::int64_t depth_lag_ns = 0;  ///< How much later than image0 the depth was taken.
};

}  // namespace waymark

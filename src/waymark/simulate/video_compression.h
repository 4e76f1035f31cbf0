// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/image/image.h"

namespace waymark {

/// What a phone or a recorder does to the images of one camera: they are written as H.264 of a bit
/// rate and read again. A key frame per second, no frame that depends on later ones.
class VideoCompression {
 public:
  /// rate_hz: of the images, which are one after the other of this camera. Throws InputError where
  /// FFmpeg's libraries are missing or have no encoder.
  VideoCompression(double kbit_per_s, double rate_hz);
  ~VideoCompression();
  VideoCompression(VideoCompression&&) noexcept;

  /// The next image as it is read again. All have the size of the first.
  Image compress(const Image& image);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "waymark/image/image.h"
#include "waymark/system/system.h"

namespace waymark {

/// A video of what was seen: the images of camera 0 with their features, those of the map and
/// others in different colours, and the state of the frame. As fast as the first two frames were.
/// In H.264, which browsers play, where the video library can write it, else in MPEG-4 Part 2.
class OverlayVideo {
 public:
  /// Throws OutputError where there cannot be such a file.
  explicit OverlayVideo(const std::filesystem::path& path);
  ~OverlayVideo();
  OverlayVideo(const OverlayVideo&) = delete;
  OverlayVideo& operator=(const OverlayVideo&) = delete;

  /// A frame that was just fed, as the system tells of it. Throws OutputError.
  void add(const FrameImages& images, const TrackingResult& result);
  /// Puts the video under its name; without it, or without frames, there is none. Throws
  /// OutputError.
  void finish();
  /// Whether browsers play it; also without frames.
  bool is_h264() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark

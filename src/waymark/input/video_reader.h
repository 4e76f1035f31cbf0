// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>

#include "waymark/image/image.h"

namespace waymark {

/// Frames of a video in order, each with the time of the container.
class VideoReader {
 public:
  /// Throws InputError for a file that is no video.
  explicit VideoReader(const std::filesystem::path& path);

  /// Steps to the next frame, past what is damaged; false at the end.
  bool grab();
  /// The frame grabbed last; nothing where it is damaged.
  std::optional<Image> decode();
  /// The same, as a JPEG file; for one that could be decoded.
  std::string encode();

  std::size_t num_grabbed() const { return num_grabbed_; }
  std::int64_t timestamp_ns() const { return timestamp_ns_; }
  double rate_hz() const { return rate_hz_; }
  /// Frames as the container states, which may be an estimate.
  std::optional<std::size_t> num_frames() const;
  /// At the end: how many frames there are less than that, if it is beyond what an estimate is off.
  std::size_t num_missing() const;

 private:
  cv::VideoCapture capture_;
  double rate_hz_;
  std::size_t num_grabbed_ = 0;
  std::int64_t timestamp_ns_ = 0;
};

}  // namespace waymark

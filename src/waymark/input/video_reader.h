// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "waymark/image/image.h"
#include "waymark/input/video_file.h"

namespace waymark {

/// Frames of a video in order, each with the time of the container. Of several files, as cameras
/// split a long recording into, those of one follow those of the file before.
class VideoReader {
 public:
  /// track: of VideoFile::tracks(). Throws InputError for a file that is no video, or without such
  /// a track.
  explicit VideoReader(std::vector<std::filesystem::path> files, std::size_t track = 0);

  /// Steps to the next frame, past what is damaged; false at the end.
  bool grab();
  /// The frame grabbed last; nothing where it is damaged.
  std::optional<Image> decode();
  /// The same, as a JPEG file; for one that could be decoded.
  std::string encode();

  std::size_t num_grabbed() const { return num_grabbed_; }
  std::int64_t timestamp_ns() const { return timestamp_ns_; }
  double rate_hz() const { return rate_hz_; }
  /// Quarters by which frames come out turned clockwise, as the container says.
  int num_quarters() const { return file_.track().num_quarters; }
  /// Frames as the container states, which may be an estimate.
  std::optional<std::size_t> num_frames() const { return num_frames_; }
  /// At the end: how many frames there are less than that, if it is beyond what an estimate is off.
  std::size_t num_missing() const;
  /// The file that is read.
  const VideoFile& file() const { return file_; }

 private:
  std::vector<std::filesystem::path> files_;
  std::size_t track_;
  VideoFile file_;
  std::size_t num_files_ended_ = 0;
  double rate_hz_;
  std::optional<std::size_t> num_frames_;
  std::size_t num_grabbed_ = 0;
  std::int64_t timestamp_ns_ = 0;
  std::int64_t file_start_ns_ = 0;  ///< The time of the first frame of the file that is read.
};

}  // namespace waymark

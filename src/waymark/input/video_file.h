// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/input/video_decoder.h"

namespace waymark {

/// Pictures that follow each other in a file.
struct VideoTrack {
  int stream = 0;  ///< Of the container.
  int width_px = 0;
  int height_px = 0;
  std::string codec;           ///< "h264", ...
  Field field = Field::kBoth;  ///< What to take of each picture; not both: it is interlaced.
  int num_quarters = 0;        ///< By which the file says to turn pictures clockwise, 0 to 3.
};

/// A packet of the telemetry of a file, as GoPro cameras write it (GPMF).
struct TelemetryPacket {
  double time_s = 0.0;      ///< Since the first picture.
  double duration_s = 0.0;  ///< As the container has it.
  std::string bytes;
};

/// One file of a video, read by FFmpeg's libraries (libavformat).
class VideoFile {
 public:
  /// track: of tracks(). Throws InputError for what is no video, and for one without its index.
  explicit VideoFile(const std::filesystem::path& path, std::size_t track = 0);

  /// The largest first; where several are, the one that the file has for its default.
  const std::vector<VideoTrack>& tracks() const { return tracks_; }
  const VideoTrack& track() const { return track_; }
  /// Frames per second as the container has them; 0: it does not say.
  double rate_hz() const;
  /// Frames as the container states or its length comes to; 0: it does not say.
  double num_frames() const;
  /// Whether the container has times for its frames.
  bool has_times() const;
  /// When the recording began, as the camera noted it, since 1970.
  std::optional<std::int64_t> created_s() const;

  /// Steps to the next picture, past what is damaged; false at the end.
  bool grab();
  /// Of the picture stepped to, since the first; nothing where the container has no times.
  std::optional<double> time_s() const;
  /// The picture stepped to, upright; nothing where it is damaged.
  std::optional<cv::Mat> picture();

 private:
  AvPointer<AVFormatContext> container_;
  std::vector<VideoTrack> tracks_;
  VideoTrack track_;
  std::optional<VideoDecoder> decoder_;
  AvPointer<AVPacket> packet_;
  bool has_ended_ = false;
};

/// The telemetry of a file, at most 256 MiB; nothing where it has none.
std::vector<TelemetryPacket> read_telemetry(const std::filesystem::path& path);

/// Whether a file holds a video, by what is in it.
bool is_video_file(const std::filesystem::path& path);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

struct AVCodecContext;
struct AVCodecParameters;
struct AVFormatContext;
struct AVFrame;
struct AVPacket;
struct SwsContext;

namespace waymark {

/// Gives back what FFmpeg's libraries made.
struct FreeAv {
  void operator()(AVCodecContext* context) const;
  void operator()(AVFormatContext* context) const;
  void operator()(AVFrame* frame) const;
  void operator()(AVPacket* packet) const;
  void operator()(SwsContext* context) const;
};
template <class T>
using AvPointer = std::unique_ptr<T, FreeAv>;

/// Which rows of an interlaced picture are taken: those of the field that is first in time.
enum class Field { kBoth, kTop, kBottom };

/// Makes pictures of the packets of one video, by FFmpeg's libraries (libavcodec, libswscale).
class VideoDecoder {
 public:
  /// Of a track. Throws std::runtime_error where the library has no decoder for it.
  explicit VideoDecoder(const AVCodecParameters& parameters);
  /// Of packets that come without a container: "h264", "hevc", ... Throws
  /// std::runtime_error.
  explicit VideoDecoder(const std::string& codec_name);

  /// Takes the next packet; nullptr at the end. What cannot be decoded is passed over.
  void send(const AVPacket* packet);
  /// The same of bytes. stamp: comes back with the picture.
  void send(std::string_view bytes, std::int64_t stamp);
  /// Steps to the next picture; false where that needs more packets.
  bool receive();
  /// The picture stepped to.
  const AVFrame& frame() const { return *frame_; }
  /// The stamp of its packet.
  std::int64_t stamp() const;
  /// The same in colour, 8 bits of blue, green, red; nothing where it cannot be converted. Of one
  /// field the rows between are the mean of their neighbours.
  std::optional<cv::Mat> picture(Field field = Field::kBoth);

 private:
  AvPointer<AVCodecContext> context_;
  AvPointer<AVFrame> frame_;
  AvPointer<SwsContext> conversion_;
};

}  // namespace waymark

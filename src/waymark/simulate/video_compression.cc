// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/video_compression.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "waymark/base/check.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/video_decoder.h"

namespace waymark {
namespace {

/// With colours at half the size, there are even sizes only.
int rounded_up_to_even(int pixels) { return pixels + pixels % 2; }

/// Videos keep to 16..235 of 256 levels, and no colour is the middle.
std::uint8_t luma_of(std::uint8_t grey) {
  return static_cast<std::uint8_t>(16 + (219 * grey + 127) / 255);
}
constexpr int kNoColour = 128;

template <class T>
AvPointer<T> made(T* object) {
  if (!object) throw std::bad_alloc();
  return AvPointer<T>(object);
}

}  // namespace

class VideoCompression::Impl {
 public:
  Impl(double kbit_per_s, double rate_hz)
      : encoder_(avcodec_find_encoder(AV_CODEC_ID_H264)),
        kbit_per_s_(kbit_per_s),
        rate_hz_(rate_hz) {
    if (!encoder_)
      throw InputError("--compressed", "FFmpeg's libraries have no encoder of H.264, expected one");
  }

  Image compress(const Image& image) {
    if (!context_) open(image);
    const AvPointer<AVFrame> frame = frame_of(image);
    if (avcodec_send_frame(context_.get(), frame.get()) < 0 ||
        avcodec_receive_packet(context_.get(), packet_.get()) < 0)
      fail("encoded");
    decoder_.send(packet_.get());
    av_packet_unref(packet_.get());
    std::optional<cv::Mat> picture;
    if (decoder_.receive()) picture = decoder_.picture();
    if (!picture) fail("decoded");
    cv::Mat grey;
    cv::extractChannel((*picture)(cv::Rect(0, 0, image.width_px, image.height_px)), grey, 0);
    return image_of<std::uint8_t>(grey);
  }

 private:
  [[noreturn]] static void fail(const char* what) {
    throw InputError(
        "--compressed",
        std::string("an image cannot be ") + what + " as H.264, expected none or another size");
  }

  void open(const Image& image) {
    context_ = made(avcodec_alloc_context3(encoder_));
    context_->width = rounded_up_to_even(image.width_px);
    context_->height = rounded_up_to_even(image.height_px);
    context_->pix_fmt = AV_PIX_FMT_YUV420P;
    context_->framerate = av_d2q(rate_hz_, 1'000'000);
    context_->time_base = av_inv_q(context_->framerate);
    context_->gop_size = std::max(1, static_cast<int>(std::lround(rate_hz_)));
    context_->max_b_frames = 0;
    context_->bit_rate = std::llround(1000.0 * kbit_per_s_);
    // No second takes more, as cards and networks want it.
    context_->rc_max_rate = context_->bit_rate;
    context_->rc_buffer_size = static_cast<int>(context_->bit_rate);
    context_->thread_count = 1;  // Images do not depend on how many there are.
    // About what hardware does, and each image comes out before the next goes in. Encoders other
    // than x264 have no such options.
    av_opt_set(context_->priv_data, "preset", "veryfast", 0);
    av_opt_set(context_->priv_data, "tune", "zerolatency", 0);
    if (avcodec_open2(context_.get(), encoder_, nullptr) < 0) fail("encoded");
  }

  AvPointer<AVFrame> frame_of(const Image& image) {
    AvPointer<AVFrame> frame = made(av_frame_alloc());
    frame->format = context_->pix_fmt;
    frame->width = context_->width;
    frame->height = context_->height;
    frame->pts = num_frames_++;
    if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
    for (int y = 0; y < frame->height; ++y) {
      const std::uint8_t* const from = image.row(std::min(y, image.height_px - 1));
      std::uint8_t* const to = frame->data[0] + y * frame->linesize[0];
      for (int x = 0; x < frame->width; ++x) to[x] = luma_of(from[std::min(x, image.width_px - 1)]);
    }
    for (const int plane : {1, 2}) {
      std::memset(frame->data[plane],
                  kNoColour,
                  static_cast<std::size_t>(frame->linesize[plane]) *
                      static_cast<std::size_t>(frame->height / 2));
    }
    return frame;
  }

  const AVCodec* encoder_;
  double kbit_per_s_;
  double rate_hz_;
  VideoDecoder decoder_{"h264"};
  AvPointer<AVPacket> packet_ = made(av_packet_alloc());
  AvPointer<AVCodecContext> context_;
  std::int64_t num_frames_ = 0;
};

VideoCompression::VideoCompression(double kbit_per_s, double rate_hz)
    : impl_(std::make_unique<Impl>(kbit_per_s, rate_hz)) {}
VideoCompression::~VideoCompression() = default;
VideoCompression::VideoCompression(VideoCompression&&) noexcept = default;

Image VideoCompression::compress(const Image& image) { return impl_->compress(image); }

}  // namespace waymark

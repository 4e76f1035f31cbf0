// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/video_decoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>
#include <thread>

namespace waymark {
namespace {

template <class T>
AvPointer<T> owned(T* made) {
  if (!made) throw std::bad_alloc();
  return AvPointer<T>(made);
}

/// The rows of one field in an image of all: row k of the field is row 2k, or 2k + 1 of the bottom
/// one; what is between is the mean of its neighbours.
cv::Mat with_rows_between(const cv::Mat& field, int num_rows, bool is_bottom) {
  cv::Mat whole(num_rows, field.cols, field.type());
  const auto row_bytes = static_cast<int>(field.cols * field.elemSize());
  for (int y = 0; y < num_rows; ++y) {
    const int above = std::clamp((y - is_bottom) >> 1, 0, field.rows - 1);
    const int below = std::clamp((y - is_bottom + 1) >> 1, 0, field.rows - 1);
    const std::uint8_t* const a = field.ptr(above);
    const std::uint8_t* const b = field.ptr(below);
    std::uint8_t* const row = whole.ptr(y);
    for (int i = 0; i < row_bytes; ++i) row[i] = static_cast<std::uint8_t>((a[i] + b[i] + 1) / 2);
  }
  return whole;
}

}  // namespace

void FreeAv::operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
void FreeAv::operator()(AVFormatContext* context) const { avformat_close_input(&context); }
void FreeAv::operator()(AVFrame* frame) const { av_frame_free(&frame); }
void FreeAv::operator()(AVPacket* packet) const { av_packet_free(&packet); }
void FreeAv::operator()(SwsContext* context) const { sws_freeContext(context); }

VideoDecoder::VideoDecoder(const AVCodecParameters& parameters) : frame_(owned(av_frame_alloc())) {
  const AVCodec* const codec = avcodec_find_decoder(parameters.codec_id);
  context_ = owned(avcodec_alloc_context3(codec));
  if (!codec || avcodec_parameters_to_context(context_.get(), &parameters) < 0) {
    throw std::runtime_error("no decoder");
  }
  context_->thread_count =
      static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
  if (avcodec_open2(context_.get(), codec, nullptr) < 0) throw std::runtime_error("no decoder");
}

VideoDecoder::VideoDecoder(const std::string& codec_name) : frame_(owned(av_frame_alloc())) {
  const AVCodec* const codec = avcodec_find_decoder_by_name(codec_name.c_str());
  if (!codec) throw std::runtime_error("no decoder");
  context_ = owned(avcodec_alloc_context3(codec));
  av_log_set_level(AV_LOG_QUIET);
  // One picture comes with each packet, where the order of the packets allows it.
  context_->thread_count = 1;
  context_->flags |= AV_CODEC_FLAG_LOW_DELAY;
  if (avcodec_open2(context_.get(), codec, nullptr) < 0) throw std::runtime_error("no decoder");
}

void VideoDecoder::send(const AVPacket* packet) {
  static_cast<void>(avcodec_send_packet(context_.get(), packet));
}

void VideoDecoder::send(std::string_view bytes, std::int64_t stamp) {
  const AvPointer<AVPacket> packet = owned(av_packet_alloc());
  if (bytes.size() > 100'000'000 || av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0)
    return;
  std::memcpy(packet->data, bytes.data(), bytes.size());
  packet->pts = packet->dts = stamp;
  send(packet.get());
}

bool VideoDecoder::receive() {
  for (;;) {
    const int result = avcodec_receive_frame(context_.get(), frame_.get());
    if (result >= 0) return true;
    // Behind what is damaged there may be whole ones.
    if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return false;
  }
}

std::int64_t VideoDecoder::stamp() const { return frame_->pts; }

std::optional<cv::Mat> VideoDecoder::picture(Field field) {
  const AVFrame& frame = *frame_;
  const int num_steps = field == Field::kBoth ? 1 : 2;
  const int num_rows = frame.height / num_steps;
  if (frame.width < 1 || num_rows < 1) return std::nullopt;
  const auto format = static_cast<AVPixelFormat>(frame.format);
  conversion_.reset(sws_getCachedContext(conversion_.release(),
                                         frame.width,
                                         num_rows,
                                         format,
                                         frame.width,
                                         num_rows,
                                         AV_PIX_FMT_BGR24,
                                         SWS_BICUBIC,
                                         nullptr,
                                         nullptr,
                                         nullptr));
  const AvPointer<AVFrame> colour = owned(av_frame_alloc());
  colour->format = AV_PIX_FMT_BGR24;
  colour->width = frame.width;
  colour->height = num_rows;
  constexpr int kAlignment = 32;  // What the library's fast ways want.
  if (!conversion_ || av_frame_get_buffer(colour.get(), kAlignment) < 0) return std::nullopt;
  const std::uint8_t* rows[AV_NUM_DATA_POINTERS];
  int steps[AV_NUM_DATA_POINTERS];
  for (int i = 0; i < AV_NUM_DATA_POINTERS; ++i) {
    const bool is_below = field == Field::kBottom && frame.data[i];
    rows[i] = is_below ? frame.data[i] + frame.linesize[i] : frame.data[i];
    steps[i] = num_steps * frame.linesize[i];
  }
  sws_scale(conversion_.get(), rows, steps, 0, num_rows, colour->data, colour->linesize);
  const cv::Mat view(num_rows,
                     frame.width,
                     CV_8UC3,
                     colour->data[0],
                     static_cast<std::size_t>(colour->linesize[0]));
  if (field == Field::kBoth) return view.clone();
  return with_rows_between(view, frame.height, field == Field::kBottom);
}

}  // namespace waymark

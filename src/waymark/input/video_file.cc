// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/video_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/parseutils.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string_view>
#include <tuple>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/listing.h"

namespace waymark {
namespace {

Field field_of(AVFieldOrder order) {
  switch (order) {
    case AV_FIELD_TT:
    case AV_FIELD_BT:
      return Field::kTop;
    case AV_FIELD_BB:
    case AV_FIELD_TB:
      return Field::kBottom;
    default:
      return Field::kBoth;
  }
}

int quarters_of(const AVStream& stream) {
#if LIBAVFORMAT_VERSION_MAJOR < 61
  const std::uint8_t* const matrix =
      av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
#else
  const AVPacketSideData* const side_data =
      av_packet_side_data_get(stream.codecpar->coded_side_data,
                              stream.codecpar->nb_coded_side_data,
                              AV_PKT_DATA_DISPLAYMATRIX);
  const std::uint8_t* const matrix = side_data ? side_data->data : nullptr;
#endif
  if (!matrix) return 0;
  const double turned_deg = av_display_rotation_get(reinterpret_cast<const std::int32_t*>(matrix));
  if (!std::isfinite(turned_deg)) return 0;
  return static_cast<int>(std::lround(-turned_deg / 90.0)) & 3;
}

std::vector<VideoTrack> tracks_of(const AVFormatContext& container) {
  std::vector<VideoTrack> tracks;
  for (unsigned i = 0; i < container.nb_streams; ++i) {
    const AVStream& stream = *container.streams[i];
    const AVCodecParameters& parameters = *stream.codecpar;
    constexpr int kStill = AV_DISPOSITION_ATTACHED_PIC | AV_DISPOSITION_TIMED_THUMBNAILS;
    if (parameters.codec_type != AVMEDIA_TYPE_VIDEO || (stream.disposition & kStill) ||
        parameters.width < 1 || parameters.height < 1) {
      continue;
    }
    tracks.push_back({static_cast<int>(i),
                      parameters.width,
                      parameters.height,
                      avcodec_get_name(parameters.codec_id),
                      field_of(parameters.field_order),
                      quarters_of(stream)});
  }
  std::ranges::stable_sort(tracks, [&](const VideoTrack& a, const VideoTrack& b) {
    const auto rank_of = [&](const VideoTrack& track) {
      const bool is_default = container.streams[track.stream]->disposition & AV_DISPOSITION_DEFAULT;
      return std::tuple(-std::int64_t{track.width_px} * track.height_px, !is_default);
    };
    return rank_of(a) < rank_of(b);
  });
  return tracks;
}

/// Whether a file is of the family of MP4 (ISO/IEC 14496-12) and lacks the box that says where in
/// it the frames are, which cameras write as the last.
bool lacks_index(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  bool is_first = true;
  for (std::uint64_t at = 0;;) {
    std::array<unsigned char, 16> head = {};
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(head.data()), head.size());
    if (file.gcount() < 8) return !is_first;
    const std::string_view kind(reinterpret_cast<const char*>(head.data()) + 4, 4);
    if ((is_first && kind != "ftyp") || kind == "moov") return false;
    is_first = false;
    const auto number_at = [&](std::size_t begin, std::size_t end) {
      std::uint64_t value = 0;
      for (std::size_t i = begin; i < end; ++i) value = (value << 8) | head[i];
      return value;
    };
    std::uint64_t size = number_at(0, 4);
    if (size == 1) size = number_at(8, 16);
    if (size < 8 || size > (std::uint64_t{1} << 60)) return true;  // 0: up to the end.
    file.clear();
    at += size;
  }
}

/// What can be opened and holds pictures; nothing otherwise. Only what the path itself names is
/// read, whatever other files or addresses a playlist has.
AvPointer<AVFormatContext> open_container(const std::filesystem::path& path) {
  // One with a name may have no writer, which would be waited for.
  if (std::error_code error; std::filesystem::is_fifo(path, error)) {
    throw InputError(path.string(), "is a pipe, expected a video file");
  }
  av_log_set_level(AV_LOG_QUIET);
  AVDictionary* options = nullptr;
  av_dict_set(&options,
              "protocol_whitelist",
              is_address(path) ? "http,https,tcp,tls,crypto,rtp,udp,rtmp,file" : "file",
              0);
  AVFormatContext* opened = nullptr;
  const std::string url = is_address(path) ? path.string() : "file:" + path.string();
  const int result = avformat_open_input(&opened, url.c_str(), nullptr, &options);
  av_dict_free(&options);
  AvPointer<AVFormatContext> container(result < 0 ? nullptr : opened);
  if (!container || avformat_find_stream_info(container.get(), nullptr) < 0) return nullptr;
  return container;
}

/// The stream of GoPro's telemetry, "GoPro MET"; -1: none.
int telemetry_stream(const AVFormatContext& container) {
  for (unsigned i = 0; i < container.nb_streams; ++i) {
    if (container.streams[i]->codecpar->codec_tag == MKTAG('g', 'p', 'm', 'd')) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

}  // namespace

VideoFile::VideoFile(const std::filesystem::path& path, std::size_t track)
    : container_(open_container(path)) {
  if (container_) tracks_ = tracks_of(*container_);
  if (tracks_.empty() && !is_address(path) && lacks_index(path)) {
    throw InputError(path.string(),
                     "is an MP4 recording that was not closed, as where the power failed: its "
                     "index (moov) is missing, expected a whole one; programs that repair it want "
                     "a whole recording of the same camera beside it");
  }
  try {
    if (tracks_.size() <= track) throw std::runtime_error("no such track");
    track_ = tracks_[track];
    for (unsigned i = 0; i < container_->nb_streams; ++i) {
      const bool is_used = static_cast<int>(i) == track_.stream;
      container_->streams[i]->discard = is_used ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
    }
    decoder_.emplace(*container_->streams[track_.stream]->codecpar);
    packet_.reset(av_packet_alloc());
  } catch (const std::runtime_error&) {
    throw InputError(path.string(),
                     "cannot be opened as a video, expected mp4, mov, avi, mkv or the like");
  }
}

double VideoFile::rate_hz() const {
  const double rate_hz = av_q2d(container_->streams[track_.stream]->avg_frame_rate);
  return std::isfinite(rate_hz) && rate_hz > 0.0 ? rate_hz : 0.0;
}

double VideoFile::num_frames() const {
  const AVStream& stream = *container_->streams[track_.stream];
  if (stream.nb_frames > 0) return static_cast<double>(stream.nb_frames);
  // That of a bare stream of packets is guessed from its bits per second.
  if (container_->duration_estimation_method == AVFMT_DURATION_FROM_BITRATE) return 0.0;
  const double from_container = static_cast<double>(container_->duration) / AV_TIME_BASE;
  const double duration_s = from_container > 0.0
                                ? from_container
                                : static_cast<double>(stream.duration) * av_q2d(stream.time_base);
  return std::max(0.0, std::floor(duration_s * rate_hz() + 0.5));
}

bool VideoFile::has_times() const { return container_->start_time != AV_NOPTS_VALUE; }

std::optional<std::int64_t> VideoFile::created_s() const {
  const AVDictionaryEntry* const entry =
      av_dict_get(container_->metadata, "creation_time", nullptr, 0);
  std::int64_t time_us = 0;
  if (!entry || av_parse_time(&time_us, entry->value, 0) < 0) return std::nullopt;
  return time_us / 1'000'000;
}

bool VideoFile::grab() {
  while (!decoder_->receive()) {
    if (has_ended_) return false;
    int result = 0;
    do {
      av_packet_unref(packet_.get());
      result = av_read_frame(container_.get(), packet_.get());
    } while (result == AVERROR(EAGAIN) || (result >= 0 && packet_->stream_index != track_.stream));
    has_ended_ = result < 0;
    decoder_->send(has_ended_ ? nullptr : packet_.get());
  }
  return true;
}

std::optional<double> VideoFile::time_s() const {
  const AVFrame& frame = decoder_->frame();
  const AVStream& stream = *container_->streams[track_.stream];
  const std::int64_t time =
      frame.pts != AV_NOPTS_VALUE && frame.pts != 0 ? frame.pts : frame.pkt_dts;
  if (time == AV_NOPTS_VALUE) return std::nullopt;
  return static_cast<double>(time - stream.start_time) * av_q2d(stream.time_base);
}

std::optional<cv::Mat> VideoFile::picture() {
  std::optional<cv::Mat> picture = decoder_->picture(track_.field);
  if (!picture || track_.num_quarters == 0) return picture;
  constexpr std::array kCodes = {
      cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  cv::Mat turned;
  cv::rotate(*picture, turned, kCodes[static_cast<std::size_t>(track_.num_quarters - 1)]);
  return turned;
}

std::vector<TelemetryPacket> read_telemetry(const std::filesystem::path& path) {
  constexpr std::size_t kMaxTelemetryBytes = std::size_t{256} << 20;
  std::vector<TelemetryPacket> packets;
  const AvPointer<AVFormatContext> container = open_container(path);
  if (!container) return packets;
  const int telemetry = telemetry_stream(*container);
  const std::vector<VideoTrack> tracks = tracks_of(*container);
  if (telemetry < 0 || tracks.empty()) return packets;
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    const bool is_used = static_cast<int>(i) == telemetry;
    container->streams[i]->discard = is_used ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
  }
  const AVStream& pictures = *container->streams[tracks.front().stream];
  const double start_s =
      pictures.start_time == AV_NOPTS_VALUE
          ? 0.0
          : static_cast<double>(pictures.start_time) * av_q2d(pictures.time_base);
  const double unit_s = av_q2d(container->streams[telemetry]->time_base);
  const AvPointer<AVPacket> packet(av_packet_alloc());
  for (std::size_t num_bytes = 0; packet && av_read_frame(container.get(), packet.get()) >= 0;) {
    const bool is_telemetry = packet->stream_index == telemetry && packet->pts != AV_NOPTS_VALUE;
    const auto size = static_cast<std::size_t>(std::max(packet->size, 0));
    num_bytes += size;
    if (is_telemetry && num_bytes <= kMaxTelemetryBytes) {
      packets.push_back({static_cast<double>(packet->pts) * unit_s - start_s,
                         static_cast<double>(packet->duration) * unit_s,
                         std::string(reinterpret_cast<const char*>(packet->data), size)});
    }
    av_packet_unref(packet.get());
    if (num_bytes > kMaxTelemetryBytes) break;
  }
  return packets;
}

bool is_video_file(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) return false;
  const AvPointer<AVFormatContext> container = open_container(path);
  if (!container) return false;
  // What it takes for single images, text and playlists is none.
  const std::string_view name = container->iformat->name;
  const bool is_other = name.ends_with("_pipe") || name.starts_with("image2") || name == "tty" ||
                        name == "hls" || name == "concat" || name == "sdp" || name == "dash";
  return !is_other && !tracks_of(*container).empty();
}

}  // namespace waymark

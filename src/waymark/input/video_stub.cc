// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// In place of video_decoder.cc and video_file.cc where FFmpeg's libraries are left out.
#include <stdexcept>

#include "waymark/base/check.h"
#include "waymark/input/video_file.h"

namespace waymark {

void FreeAv::operator()(AVCodecContext*) const {}
void FreeAv::operator()(AVFormatContext*) const {}
void FreeAv::operator()(AVFrame*) const {}
void FreeAv::operator()(AVPacket*) const {}
void FreeAv::operator()(SwsContext*) const {}

VideoDecoder::VideoDecoder(const AVCodecParameters&) { throw std::runtime_error("no decoder"); }
VideoDecoder::VideoDecoder(const std::string&) { throw std::runtime_error("no decoder"); }
void VideoDecoder::send(const AVPacket*) {}
void VideoDecoder::send(std::string_view, std::int64_t) {}
bool VideoDecoder::receive() { return false; }
std::int64_t VideoDecoder::stamp() const { return 0; }
std::optional<cv::Mat> VideoDecoder::picture(Field) { return std::nullopt; }

VideoFile::VideoFile(const std::filesystem::path& path, std::size_t) {
  throw InputError(path.string(),
                   "is a video, and this program was built without (WAYMARK_VIDEO=OFF), expected a "
                   "folder of its images");
}
double VideoFile::rate_hz() const { return 0.0; }
double VideoFile::num_frames() const { return 0.0; }
bool VideoFile::has_times() const { return false; }
std::optional<std::int64_t> VideoFile::created_s() const { return std::nullopt; }
bool VideoFile::grab() { return false; }
std::optional<double> VideoFile::time_s() const { return std::nullopt; }
std::optional<cv::Mat> VideoFile::picture() { return std::nullopt; }

std::vector<TelemetryPacket> read_telemetry(const std::filesystem::path&) { return {}; }

bool is_video_file(const std::filesystem::path&) { return false; }

}  // namespace waymark

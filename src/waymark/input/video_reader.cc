// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/video_reader.h"

#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

constexpr double kAssumedVideoRateHz = 30.0;
/// Containers that do not count their frames state what their length comes to.
constexpr double kInexact = 0.02;
constexpr std::size_t kInexactFrames = 3;

}  // namespace

VideoReader::VideoReader(std::vector<std::filesystem::path> files, std::size_t track)
    : files_(std::move(files)),
      track_(track),
      file_(files_.at(0), track),
      rate_hz_(file_.rate_hz() > 0.0 ? file_.rate_hz() : kAssumedVideoRateHz) {
  double count = file_.num_frames();
  for (std::size_t i = 1; i < files_.size() && count > 0.0; ++i) {
    const double of_file = VideoFile(files_[i], track).num_frames();
    count = of_file > 0.0 ? count + of_file : 0.0;
  }
  if (count >= 1.0 && count < 1e9) num_frames_ = static_cast<std::size_t>(count);
}

bool VideoReader::grab() {
  const auto step_ns = static_cast<std::int64_t>(1e9 / rate_hz_);
  while (!file_.grab()) {
    if (num_files_ended_ + 1 >= files_.size()) return false;
    file_ = VideoFile(files_[++num_files_ended_], track_);
    file_start_ns_ = timestamp_ns_ + step_ns;
  }
  const double time_ms = 1000.0 * file_.time_s().value_or(0.0);
  std::int64_t time_ns =
      std::abs(time_ms) < 1e12 ? std::llround(time_ms * 1e6) + file_start_ns_ : 0;
  // Some containers give no times, or the same twice.
  if (num_grabbed_ > 0 && time_ns <= timestamp_ns_) time_ns = timestamp_ns_ + step_ns;
  timestamp_ns_ = time_ns;
  ++num_grabbed_;
  return true;
}

std::optional<Image> VideoReader::decode() {
  const std::optional<cv::Mat> picture = file_.picture();
  return picture ? grey_of(*picture) : std::nullopt;
}

std::string VideoReader::encode() {
  const std::optional<cv::Mat> picture = file_.picture();
  WAYMARK_CHECK(picture);
  return jpeg_of(*picture);
}

std::size_t VideoReader::num_missing() const {
  const std::size_t stated = num_frames().value_or(0);
  if (stated <= num_grabbed_) return 0;
  const std::size_t missing = stated - num_grabbed_;
  const bool is_inexact = missing <= kInexactFrames ||
                          static_cast<double>(missing) <= kInexact * static_cast<double>(stated);
  return is_inexact ? 0 : missing;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/video_reader.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

constexpr double kAssumedVideoRateHz = 30.0;
constexpr int kMaxRetries = 50;
/// Containers that do not count their frames state what their length comes to.
constexpr double kInexact = 0.02;
constexpr std::size_t kInexactFrames = 3;

}  // namespace

VideoReader::VideoReader(const std::filesystem::path& path) {
  // Not CAP_ANY: given a file that is no video, it goes on to look for cameras.
  try {
    capture_.open(path.string(), cv::CAP_FFMPEG);
  } catch (const cv::Exception&) {
    capture_.release();
  }
  if (!capture_.isOpened()) {
    throw InputError(path.string(),
                     "cannot be opened as a video, expected mp4, mov, avi, mkv or the like");
  }
  const double rate_hz = capture_.get(cv::CAP_PROP_FPS);
  rate_hz_ = std::isfinite(rate_hz) && rate_hz > 0.0 ? rate_hz : kAssumedVideoRateHz;
}

bool VideoReader::grab() {
  // The library stops at what it cannot decode, too, and goes on where it is asked again.
  const std::size_t stated = num_frames().value_or(0);
  bool is_there = capture_.grab();
  for (int i = 0; i < kMaxRetries && !is_there && num_grabbed_ < stated; ++i) {
    is_there = capture_.grab();
  }
  if (!is_there) return false;
  const double time_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
  const std::int64_t step_ns = static_cast<std::int64_t>(1e9 / rate_hz_);
  std::int64_t time_ns =
      std::isfinite(time_ms) && std::abs(time_ms) < 1e12 ? std::llround(time_ms * 1e6) : 0;
  // Some containers give no times, or the same twice.
  if (num_grabbed_ > 0 && time_ns <= timestamp_ns_) time_ns = timestamp_ns_ + step_ns;
  timestamp_ns_ = time_ns;
  ++num_grabbed_;
  return true;
}

std::optional<Image> VideoReader::decode() {
  try {
    cv::Mat mat;
    if (!capture_.retrieve(mat)) return std::nullopt;
    return grey_of(mat);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

std::string VideoReader::encode() {
  cv::Mat mat;
  std::vector<std::uint8_t> bytes;
  WAYMARK_CHECK(capture_.retrieve(mat) && cv::imencode(".jpg", mat, bytes));
  return {bytes.begin(), bytes.end()};
}

std::size_t VideoReader::num_missing() const {
  const std::size_t stated = num_frames().value_or(0);
  if (stated <= num_grabbed_) return 0;
  const std::size_t missing = stated - num_grabbed_;
  const bool is_inexact = missing <= kInexactFrames ||
                          static_cast<double>(missing) <= kInexact * static_cast<double>(stated);
  return is_inexact ? 0 : missing;
}

std::optional<std::size_t> VideoReader::num_frames() const {
  const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  if (!(count >= 1.0 && count < 1e9)) return std::nullopt;
  return static_cast<std::size_t>(count);
}

}  // namespace waymark

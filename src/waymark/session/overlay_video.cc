// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/overlay_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/frame_state.h"

namespace waymark {
namespace {

constexpr double kMinFps = 1.0;
constexpr double kMaxFps = 120.0;
constexpr int kRadiusPx = 3;
constexpr double kTextScale = 0.5;
const cv::Scalar kOfMap(80, 200, 60);  // Blue, green, red.
const cv::Scalar kOther(60, 200, 230);
const cv::Scalar kTextColour(255, 255, 255);

/// With colours at half the size, as all players take them, there are even sizes only.
int even(int pixels) { return pixels & ~1; }

cv::Mat draw_frame(const FrameImages& images, const TrackingResult& result) {
  const ImageView& image = images.image0;
  cv::Mat grey(even(image.height_px), even(image.width_px), CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) std::copy_n(image.row(y), grey.cols, grey.ptr(y));
  cv::Mat drawn;
  cv::cvtColor(grey, drawn, cv::COLOR_GRAY2BGR);
  const std::size_t num_features = result.features ? result.features->num_primary : 0;
  for (std::size_t i = 0; i < num_features; ++i) {
    const Keypoint& keypoint = result.features->keypoints[i];
    const bool is_of_map = i < result.landmarks.size() && result.landmarks[i].is_valid();
    const cv::Point centre(cvRound(keypoint.x_px), cvRound(keypoint.y_px));
    cv::circle(drawn, centre, kRadiusPx, is_of_map ? kOfMap : kOther, 1, cv::LINE_AA);
  }
  const std::string text = fmt::format(
      "{}, {} of the map, {} features", to_string(result.state), result.num_inliers, num_features);
  cv::rectangle(drawn, {0, 0}, {drawn.cols, 22}, cv::Scalar::all(0), cv::FILLED);
  cv::putText(
      drawn, text, {6, 16}, cv::FONT_HERSHEY_SIMPLEX, kTextScale, kTextColour, 1, cv::LINE_AA);
  return drawn;
}

}  // namespace

class OverlayVideo::Impl {
 public:
  explicit Impl(std::filesystem::path path)
      : path_(std::move(path)),
        part_(path_.parent_path() / ("." + path_.stem().string() + ".part.mp4")) {
    if (path_.extension() != ".mp4") {
      throw OutputError(path_.string(), "is no name of a video, expected one that ends in .mp4");
    }
    AtomicFile{part_};  // Fails now rather than in the end.
  }
  ~Impl() {
    writer_.release();
    std::error_code error;
    std::filesystem::remove(part_, error);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void add(cv::Mat frame, std::int64_t timestamp_ns) {
    if (!writer_.isOpened() && !waiting_) {  // The second frame tells the rate.
      waiting_.emplace(std::move(frame));
      first_ns_ = timestamp_ns;
      return;
    }
    if (!writer_.isOpened()) {
      const double step_s =
          1e-9 * static_cast<double>(std::max<std::int64_t>(timestamp_ns - first_ns_, 1));
      open(std::clamp(1.0 / step_s, kMinFps, kMaxFps));
    }
    writer_.write(frame);
  }

  bool is_h264() const { return is_h264_; }

  void finish() {
    if (waiting_ && !writer_.isOpened()) open(kMinFps);
    if (!writer_.isOpened()) return;
    writer_.release();
    std::error_code error;
    std::filesystem::rename(part_, path_, error);
    if (error) throw OutputError(path_.string(), "cannot be written: " + error.message());
  }

 private:
  bool open_as(const char (&codec)[5], double fps) {
    const int name = cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]);
    return writer_.open(part_.string(), cv::CAP_FFMPEG, name, fps, waiting_->size());
  }

  void open(double fps) {
    is_h264_ = open_as("avc1", fps);
    if (!is_h264_ && !open_as("mp4v", fps)) {
      throw OutputError(path_.string(),
                        "cannot be written as a video, expected OpenCV with ffmpeg");
    }
    writer_.write(*waiting_);
  }

  const std::filesystem::path path_;
  const std::filesystem::path part_;
  cv::VideoWriter writer_;
  std::optional<cv::Mat> waiting_;  ///< The first frame.
  std::int64_t first_ns_ = 0;
  bool is_h264_ = true;
};

OverlayVideo::OverlayVideo(const std::filesystem::path& path)
    : impl_(std::make_unique<Impl>(path)) {}
OverlayVideo::~OverlayVideo() = default;

void OverlayVideo::add(const FrameImages& images, const TrackingResult& result) {
  impl_->add(draw_frame(images, result), images.timestamp_ns);
}

void OverlayVideo::finish() { impl_->finish(); }

bool OverlayVideo::is_h264() const { return impl_->is_h264(); }

}  // namespace waymark

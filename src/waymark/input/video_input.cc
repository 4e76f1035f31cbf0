// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/decode.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

constexpr double kAssumedVideoRateHz = 30.0;

/// Frames of a video in order, each with the time of the container.
class VideoReader {
 public:
  explicit VideoReader(const std::filesystem::path& path) {
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

  /// Steps to the next frame; false at the end.
  bool grab() {
    if (!capture_.grab()) return false;
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

  /// The frame grabbed last.
  std::optional<Image> decode() {
    try {
      cv::Mat mat;
      if (!capture_.retrieve(mat)) return std::nullopt;
      return grey_of(mat);
    } catch (const cv::Exception&) {
      return std::nullopt;
    }
  }
  /// The same, as a JPEG file; for one that could be decoded.
  std::string encode() {
    cv::Mat mat;
    std::vector<std::uint8_t> bytes;
    WAYMARK_CHECK(capture_.retrieve(mat) && cv::imencode(".jpg", mat, bytes));
    return {bytes.begin(), bytes.end()};
  }

  std::size_t num_grabbed() const { return num_grabbed_; }
  std::int64_t timestamp_ns() const { return timestamp_ns_; }
  double rate_hz() const { return rate_hz_; }
  /// Frames as the container states, which may be an estimate.
  std::optional<std::size_t> num_frames() const {
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (!(count >= 1.0 && count < 1e9)) return std::nullopt;
    return static_cast<std::size_t>(count);
  }

 private:
  cv::VideoCapture capture_;
  double rate_hz_ = kAssumedVideoRateHz;
  std::size_t num_grabbed_ = 0;
  std::int64_t timestamp_ns_ = 0;
};

class VideoInput : public Input {
 public:
  VideoInput(const std::filesystem::path& path, const InputOptions& options)
      : reader_(path), masks_(options.mask), has_jpeg_(options.has_jpeg) {
    info_.format = "video";
    info_.setup = choose_setup(path, {Setup::kMono}, options.setup);
    read_times_beside(path);
    const std::optional<std::size_t> num_frames =
        times_ns_.empty() ? reader_.num_frames() : std::optional(times_ns_.size());
    selection_ = select_frames(path, options, num_frames);
    if (num_frames) {
      info_.num_frames = selection_.count(*num_frames);
      match_masks(*num_frames);
    }
    info_.calibration = choose_calibration(path, options.calibration, std::nullopt, info_.setup);
    start(path);
    describe(path, options, num_frames);
  }

  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    if (first_) return std::exchange(first_, std::nullopt);
    return read();
  }

 private:
  void read_times_beside(const std::filesystem::path& path) {
    const std::filesystem::path times_path = path.parent_path() / "times.txt";
    if (!std::filesystem::exists(times_path)) return;
    times_ns_ = parse_times(read_text_file(times_path, "one time in seconds per frame"),
                            times_path.string());
  }

  void match_masks(std::size_t num_frames) {
    std::vector<std::string> stems;
    for (std::size_t i = 0; i < num_frames; ++i) stems.push_back(mask_name(i));
    masks_.match(stems);
  }

  /// The next selected frame of any kind, or nothing at the end of video, times or selection.
  std::optional<InputFrame> read() {
    if (selection_.limit && num_read_ >= *selection_.limit) return std::nullopt;
    const std::size_t index = selection_.first + selection_.every * num_read_;
    if (!times_ns_.empty() && index >= times_ns_.size()) return std::nullopt;
    while (reader_.num_grabbed() <= index) {
      if (!reader_.grab()) return std::nullopt;
    }
    ++num_read_;
    InputFrame frame;
    frame.index = index;
    frame.timestamp_ns = times_ns_.empty() ? reader_.timestamp_ns() : times_ns_[index];
    take_image(frame);
    return frame;
  }

  void take_image(InputFrame& frame) {
    std::optional<Image> image = reader_.decode();
    if (!image) {
      frame.fault = FrameFault::kUnreadable;
      return;
    }
    if (info_.width_px > 0 &&
        (image->width_px != info_.width_px || image->height_px != info_.height_px)) {
      frame.fault = FrameFault::kWrongSize;
      return;
    }
    frame.images.push_back(std::move(*image));
    if (has_jpeg_) frame.jpeg = reader_.encode();
    masks_.attach(mask_name(frame.index), frame);
  }

  void start(const std::filesystem::path& path) {
    first_ = read();
    if (!first_)
      throw InputError(path.string(),
                       "ends before the first frame asked for, expected a longer video");
    masks_.check_first(mask_name(first_->index), *first_);
    if (first_->images.empty()) {
      throw InputError(path.string(),
                       "the first frame cannot be decoded, expected a video of 8 bits per channel");
    }
    const ImageSize size{first_->images[0].width_px, first_->images[0].height_px};
    if (info_.calibration) fit_first_image(*info_.calibration, 0, size, path);
    info_.width_px = size.width_px;
    info_.height_px = size.height_px;
  }

  void describe(const std::filesystem::path& path,
                const InputOptions& options,
                std::optional<std::size_t> num_frames) {
    info_.lines.push_back(fmt::format("{}: video ({})", path.string(), to_string(info_.setup)));
    info_.lines.push_back(describe_frames(num_frames));
    info_.lines.push_back(fmt::format("images of {}x{} px", info_.width_px, info_.height_px));
    info_.lines.push_back(times_ns_.empty() ? "times from the video" : "times from times.txt");
    const std::optional<std::size_t> counted = reader_.num_frames();
    if (!times_ns_.empty() && counted && *counted != times_ns_.size()) {
      info_.lines.push_back(
          fmt::format("note: {} times for {} frames", times_ns_.size(), *counted));
    }
    info_.lines.push_back(describe_calibration(options.calibration.has_value(), info_.calibration));
  }

  std::string describe_frames(std::optional<std::size_t> num_frames) const {
    if (!times_ns_.empty()) return describe_rate(times_ns_);
    const std::string count =
        num_frames ? fmt::format("{} frames", *num_frames) : "frames not counted";
    return fmt::format("{}, {:.4g} per second", count, reader_.rate_hz());
  }

  /// Masks of a video are named by the index of the frame, six digits.
  static std::string mask_name(std::size_t index) { return fmt::format("{:06}", index); }

  VideoReader reader_;
  MaskSource masks_;
  bool has_jpeg_;
  FrameSelection selection_;
  std::vector<std::int64_t> times_ns_;
  InputInfo info_;
  std::optional<InputFrame> first_;
  std::size_t num_read_ = 0;
};

}  // namespace

std::unique_ptr<Input> open_video(const std::filesystem::path& path, const InputOptions& options) {
  silence_image_library();
  return std::make_unique<VideoInput>(path, options);
}

}  // namespace waymark

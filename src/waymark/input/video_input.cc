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
#include "waymark/input/video_reader.h"

namespace waymark {
namespace {

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

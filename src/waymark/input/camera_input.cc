// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/input/datasets.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

/// Where there is Video for Linux, only that is asked: other backends look for devices of their
/// own on every bus, and the library of one leaks what it finds.
#ifdef __linux__
constexpr int kDevices = cv::CAP_V4L2;
#else
constexpr int kDevices = cv::CAP_ANY;
#endif

/// The N of camera:N, nothing for a device.
std::optional<int> number_of(const std::filesystem::path& path) {
  constexpr std::string_view kPrefix = "camera:";
  const std::string text = path.string();
  if (!text.starts_with(kPrefix)) return std::nullopt;
  int number = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data() + kPrefix.size(), last, number);
  if (error != std::errc() || end != last || number < 0) {
    throw InputError(text, "is no camera, expected camera:N, for example camera:0");
  }
  return number;
}

/// An address without the name and password that it may hold.
std::string address_for_people(const std::string& address) {
  const std::size_t start = address.find("://");
  if (start == std::string::npos) return address;
  const std::size_t host = start + 3;
  const std::size_t end = address.find('/', host);
  const std::size_t at = address.substr(0, end).rfind('@');
  return at == std::string::npos || at < host ? address
                                              : address.substr(0, host) + address.substr(at + 1);
}

std::int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

class CameraInput : public Input {
 public:
  CameraInput(const std::filesystem::path& path, const InputOptions& options)
      : masks_(options.mask), selection_(select_frames(path, options, std::nullopt)) {
    info_.format = "camera";
    info_.is_live = true;
    info_.setup = choose_setup(path, {Setup::kMono}, options.setup);
    info_.num_frames = selection_.limit;
    info_.calibration = choose_calibration(path, options.calibration, std::nullopt, info_.setup);
    open(path);
    const std::string name = address_for_people(path.string());
    start(name);
    info_.lines = {
        fmt::format(
            "{}: {} ({})", name, is_address(path) ? "stream" : "camera", to_string(info_.setup)),
        fmt::format("images of {}x{} px", info_.width_px, info_.height_px),
        "times of arrival",
        describe_calibration(options.calibration.has_value(), info_.calibration)};
  }

  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    if (first_) return std::exchange(first_, std::nullopt);
    return read();
  }

 private:
  void open(const std::filesystem::path& path) {
    const std::optional<int> number = number_of(path);
    try {
      if (number) {
        capture_.open(*number, kDevices);
      } else if (is_address(path)) {
        capture_.open(path.string(), cv::CAP_FFMPEG);
      } else {
        capture_.open(path.string(), cv::CAP_V4L2);
      }
    } catch (const cv::Exception&) {
      capture_.release();
    }
    if (!capture_.isOpened() && is_address(path)) {
      throw InputError(address_for_people(path.string()),
                       "cannot be opened as a stream, expected an address that answers, such as "
                       "rtsp://HOST/PATH");
    }
    if (!capture_.isOpened()) {
      throw InputError(path.string(),
                       "cannot be opened as a camera, expected one that is there and free");
    }
    if (!info_.calibration || is_address(path)) return;
    const CameraDescription& camera = info_.calibration->cameras.at(0).description;
    capture_.set(cv::CAP_PROP_FRAME_WIDTH, camera.width_px);
    capture_.set(cv::CAP_PROP_FRAME_HEIGHT, camera.height_px);
  }

  void start(const std::filesystem::path& path) {
    first_ = read();
    if (!first_ || first_->images.empty()) {
      throw InputError(path.string(), "gives no images, expected those of 8 bits per channel");
    }
    const ImageSize size{first_->images[0].width_px, first_->images[0].height_px};
    if (info_.calibration) fit_first_image(*info_.calibration, 0, size, path);
    info_.width_px = size.width_px;
    info_.height_px = size.height_px;
  }

  /// The next selected frame, nothing once the camera is gone.
  std::optional<InputFrame> read() {
    if (selection_.limit && num_read_ >= *selection_.limit) return std::nullopt;
    const std::size_t index = selection_.first + selection_.every * num_read_;
    while (num_grabbed_ <= index) {
      if (!capture_.grab()) return std::nullopt;
      ++num_grabbed_;
    }
    ++num_read_;
    InputFrame frame;
    frame.index = index;
    frame.timestamp_ns = std::max(now_ns(), last_timestamp_ns_ + 1);  // The clock may be set.
    last_timestamp_ns_ = frame.timestamp_ns;
    cv::Mat mat;
    std::optional<Image> image;
    if (capture_.retrieve(mat)) image = grey_of(mat);
    if (!image) {
      frame.fault = FrameFault::kUnreadable;
    } else if (info_.width_px > 0 &&
               (image->width_px != info_.width_px || image->height_px != info_.height_px)) {
      frame.fault = FrameFault::kWrongSize;
    } else {
      frame.images.push_back(*std::move(image));
      masks_.attach(fmt::format("{:06}", index), frame);
    }
    return frame;
  }

  cv::VideoCapture capture_;
  MaskSource masks_;
  FrameSelection selection_;
  InputInfo info_;
  std::optional<InputFrame> first_;
  std::size_t num_grabbed_ = 0;
  std::size_t num_read_ = 0;
  std::int64_t last_timestamp_ns_ = 0;
};

}  // namespace

std::unique_ptr<Input> open_camera(const std::filesystem::path& path, const InputOptions& options) {
  return std::make_unique<CameraInput>(path, options);
}

}  // namespace waymark

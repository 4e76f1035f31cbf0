// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/base/check.h"
#include "waymark/camera/resized_camera.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/decode.h"
#include "waymark/input/listing.h"
#include "waymark/input/resized_input.h"
#include "waymark/input/video_reader.h"

namespace waymark {

std::optional<CameraChain> choose_calibration(const std::filesystem::path& path,
                                              const std::optional<CameraChain>& given,
                                              const std::optional<CameraChain>& carried,
                                              Setup setup) {
  std::optional<CameraChain> chain = given ? given : carried;
  if (!chain) return std::nullopt;
  const std::size_t num_needed = num_cameras(setup);
  if (chain->cameras.size() < num_needed) {
    throw InputError(
        path.string(),
        fmt::format(
            "calibration of {} camera(s), expected {} for {}; --setup mono uses camera 0 alone",
            chain->cameras.size(),
            num_needed,
            to_string(setup)));
  }
  chain->cameras.resize(num_needed);
  return chain;
}

void fit_first_image(CameraChain& chain,
                     std::size_t camera,
                     const ImageSize& size,
                     const std::filesystem::path& image) {
  CameraDescription& description = chain.cameras.at(camera).description;
  if (description.width_px == 0 && description.height_px == 0) {
    description.width_px = size.width_px;
    description.height_px = size.height_px;
  }
  if (size == ImageSize{description.width_px, description.height_px}) return;
  const int times = enlargement_for(size);
  const auto of_file = resized(description, 1.0 / times);
  if (of_file && ImageSize{times * size.width_px, times * size.height_px} ==
                     ImageSize{description.width_px, description.height_px}) {
    description = *of_file;
    return;
  }
  throw InputError(
      image.string(),
      fmt::format("is {}x{} px, expected {}x{} px as the calibration of camera {} says",
                  size.width_px,
                  size.height_px,
                  description.width_px,
                  description.height_px,
                  camera));
}

std::string describe_wrong_size(const std::filesystem::path& image,
                                const ImageSize& size,
                                const ImageSize& expected) {
  return fmt::format("{}: is {}x{} px, expected {}x{} px",
                     image.string(),
                     size.width_px,
                     size.height_px,
                     expected.width_px,
                     expected.height_px);
}

std::string describe_calibration(bool is_given, const std::optional<CameraChain>& chain) {
  if (!chain)
    return "no calibration in the input: given with -c, or found from the images of one camera";
  std::string text = is_given ? "calibration from the settings:" : "calibration from the data set:";
  for (const ChainCamera& camera : chain->cameras) {
    const CameraDescription& description = camera.description;
    text += fmt::format(" {}", description.camera_model);
    if (description.distortion_model != "none")
      text += fmt::format("-{}", description.distortion_model);
  }
  if (chain->cameras.size() == 2) {
    text += fmt::format(", baseline {:.4g} m", chain->cameras[1].cam_from_rig.translation.norm());
  }
  return text;
}

std::vector<std::size_t> longest_increasing(const std::vector<std::int64_t>& times_ns) {
  constexpr std::size_t kNone = SIZE_MAX;
  // Of the increasing parts of each length the one that ends earliest, and what comes before each.
  std::vector<std::size_t> ends;
  std::vector<std::size_t> before(times_ns.size(), kNone);
  for (std::size_t i = 0; i < times_ns.size(); ++i) {
    const auto at = std::ranges::lower_bound(
        ends, times_ns[i], {}, [&](std::size_t end) { return times_ns[end]; });
    if (at != ends.begin()) before[i] = *(at - 1);
    // Of equal times the first stays.
    if (at == ends.end()) {
      ends.push_back(i);
    } else if (times_ns[i] < times_ns[*at]) {
      *at = i;
    }
  }
  std::vector<std::size_t> used;
  for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = before[i]) {
    used.push_back(i);
  }
  std::ranges::reverse(used);
  return used;
}

bool are_most(std::size_t num_used, std::size_t num_times) {
  return 10 * (num_times - num_used) <= num_times;
}

std::vector<std::size_t> increasing_times(const std::vector<std::int64_t>& times_ns,
                                          const std::string& where,
                                          std::string_view what) {
  std::vector<std::size_t> used = longest_increasing(times_ns);
  if (are_most(used.size(), times_ns.size())) return used;
  const std::size_t num_left_out = times_ns.size() - used.size();
  throw InputError(where,
                   fmt::format("{} of {} {} have a time that is not later than the one before, "
                               "expected increasing times but for a tenth",
                               num_left_out,
                               times_ns.size(),
                               what));
}

std::string describe_out_of_order(std::size_t count, std::string_view what) {
  return fmt::format(
      "note: {} {} left out, whose time is not later than the one before", count, what);
}

std::int64_t median_step_ns(const std::vector<std::int64_t>& times_ns) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < times_ns.size(); ++i) steps.push_back(times_ns[i] - times_ns[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

void hold_back(InputFrame& frame, std::string_view partner) {
  frame.fault = FrameFault::kUnreadable;
  frame.images.clear();
  frame.mask.reset();
  if (frame.warning.empty()) {
    frame.warning = fmt::format("no {} at this moment, expected it to begin with", partner);
  }
}

MaskSource::MaskSource(const std::filesystem::path& path) : path_(path) {
  if (path_.empty()) return;
  if (std::filesystem::is_directory(path_)) {
    in_order_ = list_images(path_);
    for (const std::filesystem::path& image : in_order_) {
      by_name_[image.stem().string()] = image;
    }
    return;
  }
  if (is_video_name(path_)) {
    video_ = std::make_unique<VideoReader>(std::vector{path_});
    return;
  }
  fixed_ = read_grey_image(path_);
  if (!fixed_) throw InputError(path_.string(), describe_bad_image(path_, "a mask image"));
}

MaskSource::~MaskSource() = default;

std::filesystem::path MaskSource::path_of(const std::string& stem) const {
  return fixed_ || video_ ? path_ : by_name_.at(stem);
}

std::optional<Image> MaskSource::read(const std::string& stem, std::size_t index) const {
  if (fixed_) return fixed_;
  if (!video_) return read_grey_image(path_of(stem));
  while (video_->num_grabbed() <= index) {
    if (!video_->grab()) return std::nullopt;
  }
  std::optional<Image> mask = video_->decode();
  if (!mask) return std::nullopt;
  // Compression leaves no grey as it was.
  for (std::uint8_t& value : mask->values) value = value < 128 ? 0 : 255;
  return mask;
}

void MaskSource::match(const std::vector<std::string>& stems) {
  if (in_order_.empty()) return;
  if (std::ranges::any_of(stems, [this](const auto& stem) { return has(stem); })) return;
  if (in_order_.size() != stems.size()) {
    throw InputError(path_.string(),
                     fmt::format("no mask has the name of a frame, expected {}.png or the like, or "
                                 "as many masks as frames: {}, there are {}",
                                 stems.empty() ? "NAME" : stems.front(),
                                 stems.size(),
                                 in_order_.size()));
  }
  for (std::size_t i = 0; i < stems.size(); ++i) by_name_[stems[i]] = in_order_[i];
}

bool MaskSource::has(const std::string& stem) const {
  return fixed_ || video_ || by_name_.contains(stem);
}

void MaskSource::attach(const std::string& stem, InputFrame& frame) const {
  if (!has(stem) || frame.images.empty()) return;
  frame.mask = read(stem, frame.index);
  const ImageSize size = size_of(frame.images.front());
  if (!frame.mask) {
    frame.fault = FrameFault::kUnreadable;
    frame.warning = fmt::format(
        "{}: {}", path_of(stem).string(), describe_bad_image(path_of(stem), "a mask image"));
  } else if (size_of(*frame.mask) != size) {
    frame.fault = FrameFault::kWrongSize;
    frame.warning = describe_wrong_size(path_of(stem), size_of(*frame.mask), size);
  }
  if (frame.fault == FrameFault::kNone) return;
  frame.images.clear();
  frame.depth.reset();
  frame.mask.reset();
}

void MaskSource::check_first(const std::string& stem, const InputFrame& frame) const {
  if (!has(stem) || frame.fault == FrameFault::kNone) return;
  throw InputError(path_of(stem).string(),
                   frame.fault == FrameFault::kWrongSize
                       ? "not the size of the image, expected a mask of the same size"
                       : describe_bad_image(path_of(stem), "a mask image"));
}

cv::Mat in_8_bits(const cv::Mat& wide, const Levels& levels) {
  const double scale = 255.0 / (levels.white - levels.black);
  cv::Mat narrow;
  wide.convertTo(narrow, CV_8U, scale, -scale * levels.black);
  return narrow;
}

std::optional<Image> grey_of(const cv::Mat& frame) {
  if (frame.empty() || frame.depth() != CV_8U) return std::nullopt;
  cv::Mat grey = frame;
  if (frame.channels() == 3) cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
  if (frame.channels() == 4) cv::cvtColor(frame, grey, cv::COLOR_BGRA2GRAY);
  if (grey.channels() != 1) return std::nullopt;
  return image_of<std::uint8_t>(grey);
}

std::string jpeg_of(const cv::Mat& frame) {
  std::vector<std::uint8_t> bytes;
  WAYMARK_CHECK(cv::imencode(".jpg", frame, bytes));
  return {bytes.begin(), bytes.end()};
}

std::string change_jpeg(const std::string& jpeg,
                        const std::function<cv::Mat(const cv::Mat&)>& change) {
  if (jpeg.empty()) return {};
  const std::vector<char> bytes(jpeg.begin(), jpeg.end());
  const cv::Mat image = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  return image.empty() ? std::string() : jpeg_of(change(image));
}

}  // namespace waymark

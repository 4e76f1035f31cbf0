// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/listing_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/decode.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

/// With so many bad images in a row at the start the path is wrong rather than the disk bad.
constexpr std::size_t kMaxBadAtStart = 50;
constexpr std::string_view kDepthImage = "a 16-bit depth image";

/// Whether depth of fewer pixels shows the same as the images: as wide for its height within 1 %.
bool is_smaller_alike(const ImageSize& depth, const ImageSize& image) {
  constexpr double kSameShape = 0.01;
  const double factor_x = static_cast<double>(depth.width_px) / image.width_px;
  const double factor_y = static_cast<double>(depth.height_px) / image.height_px;
  return factor_x < 1.0 && factor_y < 1.0 && std::abs(factor_x / factor_y - 1.0) <= kSameShape;
}

/// Each pixel for all those that it covers.
DepthImage enlarged(const DepthImage& depth, const ImageSize& size) {
  const double factor_x = static_cast<double>(depth.width_px) / size.width_px;
  const double factor_y = static_cast<double>(depth.height_px) / size.height_px;
  DepthImage result(size.width_px, size.height_px);
  for (int y = 0; y < size.height_px; ++y) {
    const std::uint16_t* const from = depth.row(static_cast<int>((y + 0.5) * factor_y));
    for (int x = 0; x < size.width_px; ++x) {
      result.row(y)[x] = from[static_cast<int>((x + 0.5) * factor_x)];
    }
  }
  return result;
}

/// Of a file, as from a folder that it is in; else as it is.
std::string name_below(const std::filesystem::path& folder, const std::filesystem::path& file) {
  const std::filesystem::path below = file.lexically_relative(folder);
  const bool is_below = !below.empty() && below != "." && *below.begin() != "..";
  return (is_below ? below : file).string();
}

std::string stem_of(const ListedFrame& frame) { return frame.images.front().stem().string(); }

}  // namespace

ListingInput::ListingInput(const std::filesystem::path& path,
                           Listing listing,
                           const InputOptions& options)
    : listing_(std::move(listing)),
      selection_(select_frames(path, options, listing_.frames.size())),
      masks_(options.mask),
      has_jpeg_(options.has_jpeg),
      has_right_jpeg_(options.has_right_jpeg) {
  if (options.has_names) names_from_ = path;
  info_.has_times = listing_.has_times;
  info_.format = listing_.format;
  info_.setup = listing_.setup;
  info_.counts = listing_.counts;
  for (const ListedFrame& frame : listing_.frames) info_.times_ns.push_back(frame.timestamp_ns);
  info_.num_frames = selection_.count(listing_.frames.size());
  info_.calibration =
      choose_calibration(path, options.calibration, listing_.calibration, info_.setup);
  if (info_.calibration && !info_.calibration->depth_factor && listing_.depth_factor) {
    info_.calibration->depth_factor = listing_.depth_factor;
    listing_.notes.push_back(
        fmt::format("depth in units of 1/{:g} m, as in {}: depth.factor states others",
                    *listing_.depth_factor,
                    listing_.title));
  }
  std::vector<std::string> stems;
  for (const ListedFrame& frame : listing_.frames) stems.push_back(stem_of(frame));
  masks_.match(stems);
  find_levels();
  check_first_frame(find_first_readable());
  check_first_depth();
  describe(path, options);
  const bool may_have_imu = listing_.format == "euroc";
  take_imu(
      options, [&] { return may_have_imu ? read_euroc_imu(path) : std::nullopt; }, info_);
}

std::optional<InputFrame> ListingInput::next() {
  const std::optional<Decoding> decoding = next_decoding();
  if (!decoding) return std::nullopt;
  InputFrame frame = (*decoding)();
  complete(frame);
  return frame;
}

std::optional<Input::Decoding> ListingInput::next_decoding() {
  if (num_read_ == *info_.num_frames) return std::nullopt;
  const std::size_t index = selection_.first + selection_.every * num_read_++;
  return [this, index] { return decode(index); };
}

void ListingInput::complete(InputFrame& frame) {
  const ListedFrame& listed = listing_.frames[frame.index];
  // A bad image of camera 1 leaves the frame with camera 0, once there is a map with its scale.
  if (has_begun_ && frame.images.size() == 1 && frame.fault != FrameFault::kNone) {
    frame.fault = FrameFault::kNone;
    ++info_.counts.without_partner;
    decode_rest(listed, frame);
  }
  if (frame.fault != FrameFault::kNone) {
    frame.images.clear();
    return;
  }
  if (masks_.is_video()) masks_.attach(stem_of(listed), frame);
  if (frame.images.size() == num_cameras(info_.setup)) has_begun_ = true;
  if (!has_begun_ && frame.fault == FrameFault::kNone) hold_back(frame, "image of camera 1");
}

std::string ListingInput::describe_camera(std::size_t camera) const {
  return info_.setup == Setup::kStereo ? fmt::format(" (camera {})", camera) : "";
}

InputFrame ListingInput::decode(std::size_t index) const {
  const ListedFrame& listed = listing_.frames[index];
  InputFrame frame;
  frame.index = index;
  frame.timestamp_ns = listed.timestamp_ns;
  if (names_from_) frame.name = name_below(*names_from_, listed.images.front());
  frame.fault = read_images(listed, frame);
  if (frame.fault == FrameFault::kNone) decode_rest(listed, frame);
  return frame;
}

/// What comes with images that are used.
void ListingInput::decode_rest(const ListedFrame& listed, InputFrame& frame) const {
  read_depth(listed, frame);
  if (has_jpeg_) frame.jpeg = read_as_jpeg(listed.images.front(), levels_).value_or("");
  if (has_right_jpeg_ && frame.images.size() > 1) {
    frame.right_jpeg = read_as_jpeg(listed.images[1], levels_).value_or("");
  }
  if (!masks_.is_video()) masks_.attach(stem_of(listed), frame);
}

FrameFault ListingInput::read_images(const ListedFrame& listed, InputFrame& frame) const {
  for (std::size_t i = 0; i < listed.images.size(); ++i) {
    const std::filesystem::path& path = listed.images[i];
    std::optional<Image> image = read_grey_image(path, levels_);
    if (!image) {
      frame.warning =
          fmt::format("{}{}: {}", path.string(), describe_camera(i), describe_bad_image(path));
      return FrameFault::kUnreadable;
    }
    if (!sizes_.empty() && sizes_[i] != size_of(*image)) {
      frame.warning = describe_wrong_size(path, size_of(*image), sizes_[i]);
      return FrameFault::kWrongSize;
    }
    frame.images.push_back(std::move(*image));
  }
  return FrameFault::kNone;
}

/// A bad depth image leaves the frame without depth, as where the data set has none.
void ListingInput::read_depth(const ListedFrame& listed, InputFrame& frame) const {
  if (listed.depth.empty()) return;
  const ImageSize size = size_of(frame.images.front());
  frame.depth = read_depth_image(listed.depth);
  frame.depth_lag_ns = listed.depth_lag_ns;
  if (!frame.depth) {
    frame.warning =
        fmt::format("{}: {}", listed.depth.string(), describe_bad_image(listed.depth, kDepthImage));
  } else if (size_of(*frame.depth) != depth_size_) {
    frame.warning = describe_wrong_size(listed.depth, size_of(*frame.depth), depth_size_);
    frame.depth.reset();
  } else if (depth_size_ != size) {
    frame.depth = enlarged(*frame.depth, size);
  }
}

/// Of images of 16 bits, as the first one seen is.
void ListingInput::find_levels() {
  GreyRangeEstimator meter;
  const std::size_t num_looked = std::min(listing_.frames.size(), kNumLevelFrames);
  for (std::size_t i = 0; i < num_looked; ++i) {
    for (const auto& path : listing_.frames[i * listing_.frames.size() / num_looked].images) {
      const auto image = read_grey16_image(path);
      if (!image && read_grey_image(path)) return;
      if (image) meter.add(*image);
    }
  }
  levels_ = meter.levels();
  if (levels_ != Levels{}) listing_.notes.push_back(levels_.describe());
}

std::size_t ListingInput::find_first_readable() const {
  const std::size_t num_tried = std::min(*info_.num_frames, kMaxBadAtStart);
  for (std::size_t i = 0; i < num_tried; ++i) {
    const std::size_t index = selection_.first + selection_.every * i;
    InputFrame frame;
    const bool is_good = read_images(listing_.frames[index], frame) == FrameFault::kNone;
    if (is_good && frame.images.size() == num_cameras(info_.setup)) return index;
  }
  const std::vector<std::filesystem::path>& first = listing_.frames[selection_.first].images;
  const auto bad = std::ranges::find_if(first, [](const auto& p) { return !read_grey_image(p); });
  if (bad == first.end()) {
    throw InputError(
        first.front().string(),
        fmt::format("none of {} frames from it on has an image of camera 1 that can be "
                    "read, expected pairs",
                    num_tried));
  }
  throw InputError(
      bad->string(),
      fmt::format(
          "{}; none of {} frames from it on can be read", describe_bad_image(*bad), num_tried));
}

void ListingInput::check_first_frame(std::size_t index) {
  const ListedFrame& listed = listing_.frames[index];
  InputFrame frame;
  read_images(listed, frame);
  if (frame.images.empty()) throw std::bad_alloc();  // It could be read a moment ago.
  for (std::size_t i = 0; i < frame.images.size(); ++i) {
    const ImageSize size{frame.images[i].width_px, frame.images[i].height_px};
    if (info_.calibration) fit_first_image(*info_.calibration, i, size, listed.images[i]);
    sizes_.push_back(size);
  }
  info_.width_px = sizes_.front().width_px;
  info_.height_px = sizes_.front().height_px;
  masks_.attach(stem_of(listed), frame);
  masks_.check_first(stem_of(listed), frame);
}

void ListingInput::check_first_depth() {
  for (const ListedFrame& listed : listing_.frames) {
    if (listed.depth.empty()) continue;
    const std::optional<DepthImage> depth = read_depth_image(listed.depth);
    if (!depth) {
      throw InputError(listed.depth.string(), describe_bad_image(listed.depth, kDepthImage));
    }
    const ImageSize size{info_.width_px, info_.height_px};
    depth_size_ = size_of(*depth);
    if (listing_.format == "images" && is_smaller_alike(depth_size_, size)) {
      listing_.notes.push_back(
          fmt::format("depth images of {}x{} px are enlarged", depth->width_px, depth->height_px));
    } else if (depth_size_ != size) {
      throw InputError(listed.depth.string(),
                       fmt::format("depth of {}x{}, expected {}x{} as the colour image",
                                   depth->width_px,
                                   depth->height_px,
                                   info_.width_px,
                                   info_.height_px));
    }
    return;
  }
}

void ListingInput::describe(const std::filesystem::path& path, const InputOptions& options) {
  info_.lines.push_back(
      fmt::format("{}: {} ({})", path.string(), listing_.title, to_string(info_.setup)));
  info_.lines.push_back(describe_rate(info_.times_ns));
  std::string sizes;
  for (const ImageSize& size : sizes_) {
    sizes += fmt::format("{}{}x{}", sizes.empty() ? "" : " and ", size.width_px, size.height_px);
  }
  info_.lines.push_back(fmt::format("images of {} px", sizes));
  for (const std::string& note : listing_.notes) info_.lines.push_back(note);
  info_.lines.push_back(describe_calibration(options.calibration.has_value(), info_.calibration));
  if (*info_.num_frames != listing_.frames.size()) {
    info_.lines.push_back(fmt::format("{} used, from {} on, every {}",
                                      count_of(*info_.num_frames, "frame"),
                                      selection_.first,
                                      selection_.every));
  }
}

}  // namespace waymark

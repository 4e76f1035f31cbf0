// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/split_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/changed_input.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

/// Where the half of a camera is in a picture of that size.
cv::Rect half_of(int width_px, int height_px, Split split, int camera) {
  const bool is_beside = split == Split::kSideBySide;
  const int width = is_beside ? width_px / 2 : width_px;
  const int height = is_beside ? height_px : height_px / 2;
  return {is_beside ? camera * width : 0, is_beside ? 0 : camera * height, width, height};
}

Image cut(const Image& image, const cv::Rect& part) {
  return image_of<std::uint8_t>(mat_of(image.view())(part));
}

std::string cut_jpeg(const std::string& jpeg, Split split, int camera) {
  return change_jpeg(jpeg, [&](const cv::Mat& image) {
    return image(half_of(image.cols, image.rows, split, camera));
  });
}

class SplitInput final : public ChangedInput {
 public:
  SplitInput(std::unique_ptr<Input> input, Split split, const InputOptions& options)
      : ChangedInput(std::move(input)),
        split_(split),
        has_jpeg_(options.has_jpeg),
        has_right_jpeg_(options.has_right_jpeg) {
    const bool is_pair = options.setup
                             ? *options.setup == Setup::kStereo
                             : options.split.has_value() ||
                                   (options.calibration && options.calibration->cameras.size() > 1);
    info_.setup = choose_setup(
        "--split", {Setup::kMono, Setup::kStereo}, is_pair ? Setup::kStereo : Setup::kMono);
    const cv::Rect half = half_of(info_.width_px, info_.height_px, split, 0);
    info_.width_px = half.width;
    info_.height_px = half.height;
    info_.calibration =
        choose_calibration("--split", options.calibration, std::nullopt, info_.setup);
    for (std::size_t i = 0; info_.calibration && i < num_cameras(info_.setup); ++i) {
      fit_first_image(*info_.calibration, i, {half.width, half.height}, "--split");
    }
    describe(options);
  }

 private:
  void describe(const InputOptions& options) {
    std::vector<std::string>& lines = info_.lines;
    std::erase_if(lines, [](const std::string& line) {
      return line.starts_with("no calibration in the data set");
    });
    if (const auto at = lines.front().rfind("(mono)"); at != std::string::npos) {
      lines.front().replace(at, 6, fmt::format("({})", to_string(info_.setup)));
    }
    lines.push_back(
        fmt::format("two cameras of {}x{} px {} in each picture, {}",
                    info_.width_px,
                    info_.height_px,
                    split_ == Split::kSideBySide ? "side by side" : "one above the other",
                    info_.setup == Setup::kStereo
                        ? "taken as a pair"
                        : "of which the first is used; for a pair calibrate both with -c"));
    lines.push_back(describe_calibration(options.calibration.has_value(), info_.calibration));
  }

  void change(InputFrame& frame) const override {
    if (frame.images.size() == 1) {
      const Image whole = std::move(frame.images.front());
      frame.images.clear();
      const std::size_t count = num_cameras(info_.setup);
      for (std::size_t i = 0; i < count; ++i) {
        frame.images.push_back(
            cut(whole, half_of(whole.width_px, whole.height_px, split_, static_cast<int>(i))));
      }
    }
    if (frame.mask) {
      const cv::Rect half = half_of(frame.mask->width_px, frame.mask->height_px, split_, 0);
      frame.mask = cut(*frame.mask, half);
    }
    if (has_right_jpeg_ && info_.setup == Setup::kStereo) {
      frame.right_jpeg = cut_jpeg(frame.jpeg, split_, 1);
    }
    frame.jpeg = has_jpeg_ ? cut_jpeg(frame.jpeg, split_, 0) : "";
  }

  const Split split_;
  const bool has_jpeg_;
  const bool has_right_jpeg_;
};

/// The share of textured patches of the first half that the second half has within a narrow band
/// about the same row (column), and nowhere else as well; nothing where few have texture.
std::optional<double> share_alike(const cv::Mat& first, const cv::Mat& second, bool is_beside) {
  constexpr int kPatch = 16;
  constexpr int kStep = 12;
  constexpr int kBand = 3;
  constexpr double kTexture = 8.0;  // Standard deviation.
  constexpr double kAlike = 0.85;   // Correlation.
  constexpr int kFewest = 12;
  int num_textured = 0;
  int num_alike = 0;
  for (int y = 0; y + kPatch <= first.rows; y += kStep) {
    for (int x = 0; x + kPatch <= first.cols; x += kStep) {
      const cv::Mat patch = first(cv::Rect(x, y, kPatch, kPatch));
      cv::Scalar mean;
      cv::Scalar deviation;
      cv::meanStdDev(patch, mean, deviation);
      if (deviation[0] < kTexture) continue;
      ++num_textured;
      cv::Mat scores;
      cv::matchTemplate(second, patch, scores, cv::TM_CCOEFF_NORMED);
      double best = 0.0;
      cv::Point at;
      cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
      // What is packed one above the other may have been taken side by side.
      const int off_row = std::abs(at.y - y);
      const int off = is_beside ? off_row : std::min(off_row, std::abs(at.x - x));
      num_alike += best >= kAlike && off <= kBand;
    }
  }
  if (num_textured < kFewest) return std::nullopt;
  return static_cast<double>(num_alike) / num_textured;
}

}  // namespace

std::optional<Split> split_by_size(const ImageSize& picture, const ImageSize& camera) {
  if (picture == ImageSize{2 * camera.width_px, camera.height_px}) return Split::kSideBySide;
  if (picture == ImageSize{camera.width_px, 2 * camera.height_px}) return Split::kTopBottom;
  return std::nullopt;
}

bool may_hold_two(const ImageSize& picture) {
  constexpr int kSmallest = 32;
  return std::min(picture.width_px, picture.height_px) >= kSmallest &&
         (picture.width_px >= 2 * picture.height_px || picture.height_px >= picture.width_px);
}

std::optional<Split> split_by_content(const Image& picture) {
  constexpr int kHalfSidePx = 160;
  constexpr double kMost = 0.6;
  if (!may_hold_two(size_of(picture))) return std::nullopt;
  const bool is_beside = picture.width_px >= 2 * picture.height_px;
  const Split split = is_beside ? Split::kSideBySide : Split::kTopBottom;
  const cv::Mat whole = mat_of(picture.view());
  const auto small_half = [&](int camera) {
    const cv::Mat half = whole(half_of(whole.cols, whole.rows, split, camera));
    const double factor = static_cast<double>(kHalfSidePx) / std::max(half.cols, half.rows);
    cv::Mat small;
    cv::resize(half, small, {}, factor, factor, cv::INTER_AREA);
    return small;
  };
  const std::optional<double> share = share_alike(small_half(0), small_half(1), is_beside);
  return share && *share >= kMost ? std::optional(split) : std::nullopt;
}

std::unique_ptr<Input> split_input(std::unique_ptr<Input> input,
                                   Split split,
                                   const InputOptions& options) {
  return std::make_unique<SplitInput>(std::move(input), split, options);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/resized_input.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/resized_camera.h"
#include "waymark/image/convert.h"
#include "waymark/input/changed_input.h"

namespace waymark {
namespace {

/// Also for colour, which is kept for people and programs that follow.
std::string resize_jpeg(const std::string& jpeg, double factor) {
  if (jpeg.empty()) return {};
  const std::vector<char> bytes(jpeg.begin(), jpeg.end());
  const cv::Mat image = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (image.empty()) return {};
  const cv::Size size(static_cast<int>(factor * image.cols), static_cast<int>(factor * image.rows));
  cv::Mat small;
  cv::resize(image, small, size, 0.0, 0.0, cv::INTER_AREA);
  std::vector<unsigned char> result;
  cv::imencode(".jpg", small, result);
  return {result.begin(), result.end()};
}

class ResizedInput final : public ChangedInput {
 public:
  ResizedInput(std::unique_ptr<Input> input, double factor)
      : ChangedInput(std::move(input)), factor_(factor) {
    info_.width_px = static_cast<int>(factor * info_.width_px);
    info_.height_px = static_cast<int>(factor * info_.height_px);
    if (info_.focal_px) *info_.focal_px *= factor;
    info_.lines.push_back(fmt::format("resized to {}x{} px", info_.width_px, info_.height_px));
    if (!info_.calibration) return;
    for (ChainCamera& camera : info_.calibration->cameras) {
      const auto description = resized(camera.description, factor);
      if (!description) {
        throw InputError("--resize",
                         fmt::format("does not know what the numbers of model '{}' mean, expected "
                                     "images of the size that it was calibrated for",
                                     camera.description.camera_model));
      }
      camera.description = *description;
    }
  }

 private:
  void change(InputFrame& frame) const override {
    for (Image& image : frame.images) image = reduce(image.view(), factor_);
    if (frame.depth) frame.depth = pick_reduced(frame.depth->view(), factor_);
    if (frame.mask) frame.mask = pick_reduced(frame.mask->view(), factor_);
    frame.jpeg = resize_jpeg(frame.jpeg, factor_);
    frame.right_jpeg = resize_jpeg(frame.right_jpeg, factor_);
  }

  const double factor_;
};

}  // namespace

std::unique_ptr<Input> resize_input(std::unique_ptr<Input> input, int width_px) {
  const int before_px = input->info().width_px;
  if (width_px < 1 || width_px >= before_px) {
    throw InputError(
        "--resize",
        fmt::format(
            "is {}, expected less than the {} px that images are wide", width_px, before_px));
  }
  // The width must not be rounded down to one pixel less.
  constexpr double kRounding = 1e-6;
  return std::make_unique<ResizedInput>(std::move(input), (width_px + kRounding) / before_px);
}

}  // namespace waymark

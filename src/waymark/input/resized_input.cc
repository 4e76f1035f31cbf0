// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/resized_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/resized_camera.h"
#include "waymark/image/convert.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/changed_input.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

cv::Mat resize(const cv::Mat& image, double factor) {
  const cv::Size size(static_cast<int>(factor * image.cols), static_cast<int>(factor * image.rows));
  cv::Mat changed;
  cv::resize(image, changed, size, 0.0, 0.0, factor < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return changed;
}

bool can_resize(const InputInfo& info) {
  return !info.calibration ||
         std::ranges::all_of(info.calibration->cameras, [](const ChainCamera& camera) {
           return resized(camera.description, 1.0).has_value();
         });
}

class ResizedInput final : public ChangedInput {
 public:
  ResizedInput(std::unique_ptr<Input> input, double factor)
      : ChangedInput(std::move(input)), factor_(factor) {
    info_.width_px = static_cast<int>(factor * info_.width_px);
    info_.height_px = static_cast<int>(factor * info_.height_px);
    info_.lines.push_back(fmt::format("{} to {}x{} px",
                                      factor < 1.0 ? "resized" : "small images, enlarged",
                                      info_.width_px,
                                      info_.height_px));
    if (factor > 1.0) info_.enlargement = static_cast<int>(factor);
    if (!info_.calibration) return;
    for (ChainCamera& camera : info_.calibration->cameras) {
      const auto smaller = resized(camera, factor);
      if (!smaller) {
        throw InputError("--resize",
                         fmt::format("does not know what the numbers of model '{}' mean, expected "
                                     "images of the size that it was calibrated for",
                                     camera.description.camera_model));
      }
      camera = *smaller;
    }
  }

  CameraChain of_unchanged_images(CameraChain chain) const override {
    const InputInfo& whole = unchanged_info();
    for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
      const auto enlarged = resized(chain.cameras[i], 1.0 / factor_);
      if (!enlarged) continue;  // What is not of the images has been refused when it was opened.
      chain.cameras[i] = *enlarged;
      // Sizes were rounded down.
      CameraDescription& camera = chain.cameras[i].description;
      camera.width_px = whole.width_px;
      camera.height_px = whole.height_px;
      if (!whole.calibration || i >= whole.calibration->cameras.size()) continue;
      camera.width_px = whole.calibration->cameras[i].description.width_px;
      camera.height_px = whole.calibration->cameras[i].description.height_px;
    }
    return ChangedInput::of_unchanged_images(std::move(chain));
  }

 private:
  void change(InputFrame& frame) const override {
    for (Image& image : frame.images) {
      image = factor_ < 1.0 ? reduce(image.view(), factor_)
                            : image_of<std::uint8_t>(resize(mat_of(image.view()), factor_));
    }
    if (frame.depth) frame.depth = pick_reduced(frame.depth->view(), factor_);
    if (frame.mask) frame.mask = pick_reduced(frame.mask->view(), factor_);
    const auto changed = [this](const cv::Mat& image) { return resize(image, factor_); };
    frame.jpeg = change_jpeg(frame.jpeg, changed);
    frame.right_jpeg = change_jpeg(frame.right_jpeg, changed);
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

int enlargement_for(const ImageSize& size) {
  constexpr int kSmallestSidePx = 16;  // Of any camera: what is smaller is refused later.
  constexpr int kSmallLongSidePx = 320, kSmallShortSidePx = 240;
  constexpr double kLongSidePx = 400.0, kShortSidePx = 300.0;
  constexpr double kMaxEnlargement = 4.0;
  const auto [short_px, long_px] = std::minmax(size.width_px, size.height_px);
  if (short_px < kSmallestSidePx || short_px >= kSmallShortSidePx || long_px >= kSmallLongSidePx) {
    return 1;
  }
  const double missing = std::min(kLongSidePx / long_px, kShortSidePx / short_px);
  return static_cast<int>(std::ceil(std::min(missing, kMaxEnlargement)));
}

std::unique_ptr<Input> enlarge_if_small(std::unique_ptr<Input> input) {
  const InputInfo& info = input->info();
  const int times = enlargement_for({info.width_px, info.height_px});
  if (times == 1 || !can_resize(info)) return input;
  return std::make_unique<ResizedInput>(std::move(input), times);
}

}  // namespace waymark

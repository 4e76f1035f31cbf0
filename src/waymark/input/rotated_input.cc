// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/rotated_input.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/rotated_camera.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/changed_input.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

cv::Mat turn(const cv::Mat& image, int num_quarters) {
  constexpr std::array kCodes = {
      cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  cv::Mat turned;
  cv::rotate(image, turned, kCodes[static_cast<std::size_t>(num_quarters - 1)]);
  return turned;
}

template <class T>
BasicImage<T> turn(const BasicImage<T>& image, int num_quarters) {
  return image_of<T>(turn(mat_of(image.view()), num_quarters));
}

ChainCamera turn(const ChainCamera& camera, int num_quarters) {
  if (const auto turned = rotated(camera, num_quarters)) return *turned;
  throw InputError("--rotate",
                   fmt::format("cannot turn a camera of model '{}' by {} degrees, expected images "
                               "as it was calibrated for",
                               camera.description.camera_model,
                               90 * num_quarters));
}

class RotatedInput final : public ChangedInput {
 public:
  RotatedInput(std::unique_ptr<Input> input, int num_quarters)
      : ChangedInput(std::move(input)), num_quarters_(num_quarters) {
    if (num_quarters % 2 == 1) std::swap(info_.width_px, info_.height_px);
    info_.lines.push_back(fmt::format("turned clockwise by {} degrees: {}x{} px",
                                      90 * num_quarters,
                                      info_.width_px,
                                      info_.height_px));
    turn_imu(info_, num_quarters);
    if (!info_.calibration) return;
    for (ChainCamera& camera : info_.calibration->cameras) {
      const bool has_readout = camera.readout_s != 0.0 && num_quarters % 2 == 1;
      camera = turn(camera, num_quarters);
      if (has_readout) info_.lines.push_back("note: the readout of turned rows is not used");
    }
  }

  CameraChain of_unchanged_images(CameraChain chain) const override {
    for (ChainCamera& camera : chain.cameras) camera = turn(camera, 4 - num_quarters_);
    return ChangedInput::of_unchanged_images(std::move(chain));
  }

 private:
  void change(InputFrame& frame) const override {
    for (Image& image : frame.images) image = turn(image, num_quarters_);
    if (frame.depth) frame.depth = turn(*frame.depth, num_quarters_);
    if (frame.mask) frame.mask = turn(*frame.mask, num_quarters_);
    const auto turned = [this](const cv::Mat& image) { return turn(image, num_quarters_); };
    frame.jpeg = change_jpeg(frame.jpeg, turned);
    frame.right_jpeg = change_jpeg(frame.right_jpeg, turned);
  }

  const int num_quarters_;
};

}  // namespace

std::unique_ptr<Input> rotate_input(std::unique_ptr<Input> input, int clockwise_deg) {
  if (clockwise_deg != 90 && clockwise_deg != 180 && clockwise_deg != 270) {
    throw InputError("--rotate", fmt::format("is {}, expected 90, 180 or 270", clockwise_deg));
  }
  return std::make_unique<RotatedInput>(std::move(input), clockwise_deg / 90);
}

}  // namespace waymark

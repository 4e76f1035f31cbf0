// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/rotated_input.h"

#include <fmt/format.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/rotated_camera.h"
#include "waymark/input/changed_input.h"

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
  const cv::Mat mat(image.height_px,
                    image.width_px,
                    cv::DataType<T>::type,
                    const_cast<T*>(image.values.data()));  // Is only read.
  const cv::Mat turned = turn(mat, num_quarters);
  BasicImage<T> result(turned.cols, turned.rows);
  for (int y = 0; y < turned.rows; ++y) {
    std::memcpy(result.row(y), turned.ptr(y), sizeof(T) * static_cast<std::size_t>(turned.cols));
  }
  return result;
}

std::string turn_jpeg(const std::string& jpeg, int num_quarters) {
  if (jpeg.empty()) return {};
  const std::vector<char> bytes(jpeg.begin(), jpeg.end());
  const cv::Mat image = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (image.empty()) return {};
  std::vector<unsigned char> result;
  cv::imencode(".jpg", turn(image, num_quarters), result);
  return {result.begin(), result.end()};
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
    if (!info_.calibration) return;
    for (ChainCamera& camera : info_.calibration->cameras) {
      const bool has_readout = camera.readout_s != 0.0 && num_quarters % 2 == 1;
      const auto turned = rotated(camera, num_quarters);
      if (!turned) {
        throw InputError("--rotate",
                         fmt::format("cannot turn a camera of model '{}' by {} degrees, expected "
                                     "images as it was calibrated for",
                                     camera.description.camera_model,
                                     90 * num_quarters));
      }
      camera = *turned;
      if (has_readout) info_.lines.push_back("note: the readout of turned rows is not used");
    }
  }

 private:
  void change(InputFrame& frame) const override {
    for (Image& image : frame.images) image = turn(image, num_quarters_);
    if (frame.depth) frame.depth = turn(*frame.depth, num_quarters_);
    if (frame.mask) frame.mask = turn(*frame.mask, num_quarters_);
    frame.jpeg = turn_jpeg(frame.jpeg, num_quarters_);
    frame.right_jpeg = turn_jpeg(frame.right_jpeg, num_quarters_);
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

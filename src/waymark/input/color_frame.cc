// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/color_frame.h"

#include <cstring>
#include <opencv2/imgproc.hpp>

namespace waymark {

std::optional<Image> grey_of(const cv::Mat& frame) {
  if (frame.empty() || frame.depth() != CV_8U) return std::nullopt;
  cv::Mat grey = frame;
  if (frame.channels() == 3) cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
  if (frame.channels() == 4) cv::cvtColor(frame, grey, cv::COLOR_BGRA2GRAY);
  if (grey.channels() != 1) return std::nullopt;
  Image image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) {
    std::memcpy(image.row(y), grey.ptr(y), static_cast<std::size_t>(grey.cols));
  }
  return image;
}

}  // namespace waymark

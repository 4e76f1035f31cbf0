// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>

#include "waymark/image/image.h"

/// From and to OpenCV's images; for .cc files.
namespace waymark {

/// Borrows the values, which must only be read.
template <class T>
cv::Mat mat_of(const BasicImageView<T>& image) {
  return {image.height_px,
          image.width_px,
          cv::DataType<T>::type,
          const_cast<T*>(image.data),
          sizeof(T) * static_cast<std::size_t>(image.stride)};
}

/// Copies values of this type, one per pixel.
template <class T>
BasicImage<T> image_of(const cv::Mat& mat) {
  BasicImage<T> image(mat.cols, mat.rows);
  for (int y = 0; y < mat.rows; ++y) std::copy_n(mat.ptr<T>(y), mat.cols, image.row(y));
  return image;
}

}  // namespace waymark

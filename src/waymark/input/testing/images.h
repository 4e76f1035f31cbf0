// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

namespace waymark::testing {

/// Writes an image of one value; type as in OpenCV.
inline void write_image(const std::filesystem::path& path,
                        int width_px,
                        int height_px,
                        double value,
                        int type = CV_8UC1) {
  std::filesystem::create_directories(path.parent_path());
  cv::imwrite(path.string(), cv::Mat(height_px, width_px, type, cv::Scalar::all(value)));
}

/// Cuts a file down to a part of its length.
inline void truncate_file(const std::filesystem::path& path, double part) {
  const auto size = static_cast<double>(std::filesystem::file_size(path));
  std::filesystem::resize_file(path, static_cast<std::uintmax_t>(part * size));
}

}  // namespace waymark::testing

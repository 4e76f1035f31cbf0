// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

namespace waymark::testing {

/// Frames of value 20, 40, ... at 10 per second.
inline void make_video(const std::filesystem::path& path, int num_frames) {
  cv::VideoWriter writer(
      path.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10.0, {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 1; i <= num_frames; ++i)
    writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(20 * i)));
}

}  // namespace waymark::testing

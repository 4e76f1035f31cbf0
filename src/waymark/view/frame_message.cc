// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/frame_message.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace waymark {
namespace {

constexpr int kMaxWidth = 640;
constexpr int kQuality = 70;

}  // namespace

std::string encode_preview(const Image& image) {
  if (image.view().is_empty()) return {};
  const cv::Mat whole(
      image.height_px, image.width_px, CV_8U, const_cast<std::uint8_t*>(image.values.data()));
  cv::Mat small = whole;
  if (image.width_px > kMaxWidth) {
    const double scale = static_cast<double>(kMaxWidth) / image.width_px;
    const int height = std::max(1, static_cast<int>(std::lround(scale * image.height_px)));
    cv::resize(whole, small, {kMaxWidth, height}, 0, 0, cv::INTER_AREA);
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return {bytes.begin(), bytes.end()};
}

Message encode_frame(const DrawnFrame& frame, std::int64_t start_ns) {
  const std::string jpeg = encode_preview(frame.image);
  const std::size_t num_features = frame.features ? frame.features->num_primary : 0;
  MessageWriter writer(MessageKind::kFrame, num_features);
  writer.add(frame.frame.value);
  writer.add(static_cast<float>(1e-9 * static_cast<double>(frame.timestamp_ns - start_ns)));
  writer.add(static_cast<std::uint32_t>(frame.width_px));
  writer.add(static_cast<std::uint32_t>(frame.height_px));
  writer.add(static_cast<std::uint32_t>(jpeg.size()));
  for (std::size_t i = 0; i < num_features; ++i) {
    writer.add(frame.features->keypoints[i].x_px);
    writer.add(frame.features->keypoints[i].y_px);
  }
  for (std::size_t i = 0; i < num_features; ++i) {
    const bool sees = i < frame.landmarks.size() && frame.landmarks[i].is_valid();
    writer.add(static_cast<std::uint8_t>(sees));
  }
  writer.pad_to(4);
  writer.add_bytes(jpeg);
  return writer.finish();
}

}  // namespace waymark

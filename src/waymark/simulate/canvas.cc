// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Fractional bits of OpenCV's drawing coordinates.
constexpr int kShift = 4;

std::uint8_t to_grey(int grey) { return static_cast<std::uint8_t>(std::clamp(grey, 0, 255)); }

cv::Mat wrap(Image& image) {
  return cv::Mat(image.height_px, image.width_px, CV_8UC1, image.values.data());
}

cv::Point fixed_point(const Eigen::Vector2d& point_m, double texel_m) {
  const Eigen::Vector2d texel = point_m / texel_m - Eigen::Vector2d::Constant(0.5);
  return {static_cast<int>(std::lround(texel.x() * (1 << kShift))),
          static_cast<int>(std::lround(texel.y() * (1 << kShift)))};
}

}  // namespace

Canvas::Canvas(const Eigen::Vector2d& size_m, double texel_m, int grey)
    : image_(std::max(1, static_cast<int>(std::ceil(size_m.x() / texel_m - 1e-9))),
             std::max(1, static_cast<int>(std::ceil(size_m.y() / texel_m - 1e-9)))),
      size_m_(size_m),
      texel_m_(texel_m) {
  std::fill(image_.values.begin(), image_.values.end(), to_grey(grey));
}

void Canvas::fill_polygon(std::span<const Eigen::Vector2d> corners_m, int grey) {
  constexpr std::size_t kMaxCorners = 16;
  WAYMARK_CHECK(corners_m.size() >= 3 && corners_m.size() <= kMaxCorners);
  std::array<cv::Point, kMaxCorners> points;
  for (std::size_t i = 0; i < corners_m.size(); ++i)
    points[i] = fixed_point(corners_m[i], texel_m_);
  const cv::Point* begin = points.data();
  const int count = static_cast<int>(corners_m.size());
  cv::Mat mat = wrap(image_);
  cv::fillPoly(mat, &begin, &count, 1, cv::Scalar(to_grey(grey)), cv::LINE_AA, kShift);
}

void Canvas::fill_circle(const Eigen::Vector2d& centre_m, double radius_m, int grey) {
  cv::Mat mat = wrap(image_);
  const int radius = static_cast<int>(std::lround(radius_m / texel_m_ * (1 << kShift)));
  cv::circle(mat,
             fixed_point(centre_m, texel_m_),
             radius,
             cv::Scalar(to_grey(grey)),
             cv::FILLED,
             cv::LINE_AA,
             kShift);
}

void Canvas::draw_line(const Eigen::Vector2d& from_m,
                       const Eigen::Vector2d& to_m,
                       double width_m,
                       int grey) {
  cv::Mat mat = wrap(image_);
  const int thickness = std::max(1, static_cast<int>(std::lround(width_m / texel_m_)));
  cv::line(mat,
           fixed_point(from_m, texel_m_),
           fixed_point(to_m, texel_m_),
           cv::Scalar(to_grey(grey)),
           thickness,
           cv::LINE_AA,
           kShift);
}

void Canvas::fill_area(const Area& area_m, int grey) {
  const auto texel = [&](double value) {
    return static_cast<int>(std::floor(value / texel_m_ + 0.5));
  };
  // At least one each way.
  const int x0 = texel(area_m.min.x()), y0 = texel(area_m.min.y());
  const int x1 = std::min(std::max(texel(area_m.max.x()), x0 + 1), image_.width_px);
  const int y1 = std::min(std::max(texel(area_m.max.y()), y0 + 1), image_.height_px);
  for (int y = std::max(y0, 0); y < y1; ++y) {
    if (x1 > x0)
      std::fill(image_.row(y) + std::max(x0, 0), image_.row(y) + std::max(x1, 0), to_grey(grey));
  }
}

int Canvas::grey_at(const Eigen::Vector2d& point_m) const {
  const int x = static_cast<int>(std::floor(point_m.x() / texel_m_));
  const int y = static_cast<int>(std::floor(point_m.y() / texel_m_));
  return image_.row(std::clamp(y, 0, image_.height_px - 1))[std::clamp(x, 0, image_.width_px - 1)];
}

}  // namespace waymark

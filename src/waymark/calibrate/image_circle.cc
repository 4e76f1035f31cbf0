// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/image_circle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace waymark {
namespace {

/// Mean difference of two columns over all images, in grey values.
double difference_of_columns(std::span<const Image> images, int one, int other) {
  double sum = 0.0;
  double count = 0.0;
  for (const Image& image : images) {
    for (int y = 0; y < image.height_px; ++y) {
      sum += std::abs(int{image.row(y)[one]} - int{image.row(y)[other]});
      ++count;
    }
  }
  return sum / count;
}

/// The brightest that each pixel gets.
Image brightest_of(std::span<const Image> images) {
  Image brightest = images.front();
  for (const Image& image : images) {
    std::transform(image.values.begin(),
                   image.values.end(),
                   brightest.values.begin(),
                   brightest.values.begin(),
                   [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); });
  }
  return brightest;
}

/// First and last lit pixel of each row, where the image's border does not cut it off.
std::vector<Eigen::Vector2d> lit_borders(const Image& image) {
  constexpr int kBlack = 20;
  std::vector<Eigen::Vector2d> borders;
  for (int y = 0; y < image.height_px; ++y) {
    int first = 0;
    int last = image.width_px - 1;
    while (first < image.width_px && image.row(y)[first] <= kBlack) ++first;
    while (last >= first && image.row(y)[last] <= kBlack) --last;
    if (last - first < image.width_px / 8) continue;
    if (first > 1) borders.emplace_back(first, y);
    if (last < image.width_px - 2) borders.emplace_back(last, y);
  }
  return borders;
}

/// Least squares of x^2 + y^2 + a x + b y + c = 0 (Kasa 1976).
ImageCircle fit_circle(std::span<const Eigen::Vector2d> points) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector3d row(point.x(), point.y(), 1.0);
    matrix += row * row.transpose();
    right -= row * point.squaredNorm();
  }
  const Eigen::Vector3d abc = matrix.ldlt().solve(right);
  const Eigen::Vector2d center = -0.5 * abc.head<2>();
  return {center, std::sqrt(std::max(0.0, center.squaredNorm() - abc[2]))};
}

}  // namespace

bool are_equirectangular(std::span<const Image> images) {
  constexpr double kMaxAspectError = 0.01;
  constexpr double kNoise = 2.0;  // Of grey values, compression included.
  if (images.empty()) return false;
  const int width = images.front().width_px;
  if (width < 4) return false;
  if (std::abs(0.5 * width / images.front().height_px - 1.0) > kMaxAspectError) return false;
  const double across = difference_of_columns(images, 0, width - 1);
  const double beside = std::max(difference_of_columns(images, 0, 1),
                                 difference_of_columns(images, width - 2, width - 1));
  const double elsewhere = std::max(difference_of_columns(images, 0, width / 4),
                                    difference_of_columns(images, 0, width / 2));
  return across < 2.0 * beside + kNoise && across < 0.5 * elsewhere + kNoise;
}

std::optional<ImageCircle> find_image_circle(std::span<const Image> images) {
  constexpr double kMaxErrorPart = 0.015;  // Of the radius.
  constexpr double kMaxOutliers = 0.1;
  if (images.empty()) return std::nullopt;
  const Image brightest = brightest_of(images);
  const std::vector<Eigen::Vector2d> borders = lit_borders(brightest);
  if (borders.size() < static_cast<std::size_t>(brightest.height_px) / 4) return std::nullopt;
  const ImageCircle circle = fit_circle(borders);
  const auto num_outside = std::ranges::count_if(borders, [&](const Eigen::Vector2d& point) {
    const double radius = (point - circle.center_px).norm();
    return !(std::abs(radius - circle.radius_px) < kMaxErrorPart * circle.radius_px);
  });
  const bool is_circle =
      static_cast<double>(num_outside) < kMaxOutliers * static_cast<double>(borders.size());
  const bool is_in_image =
      2.5 * circle.radius_px > brightest.height_px &&
      circle.radius_px < 0.5 * std::hypot(brightest.width_px, brightest.height_px);
  if (!is_circle || !is_in_image) return std::nullopt;
  return circle;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/simulate/texture_drawing.h"

namespace waymark {
namespace {

using Eigen::Vector2d;

/// Fractional bits of OpenCV's drawing coordinates.
constexpr int kShift = 4;

std::uint8_t to_grey(int grey) { return static_cast<std::uint8_t>(std::clamp(grey, 0, 255)); }

cv::Mat wrap(Image& image) {
  return cv::Mat(image.height_px, image.width_px, CV_8UC1, image.values.data());
}

cv::Point fixed_point(const Vector2d& point_m, double texel_m) {
  const Eigen::Vector2d texel = point_m / texel_m - Eigen::Vector2d::Constant(0.5);
  return {static_cast<int>(std::lround(texel.x() * (1 << kShift))),
          static_cast<int>(std::lround(texel.y() * (1 << kShift)))};
}

/// Marks below this many texels are drawn as plain rectangles.
constexpr double kSmallTexels = 4.0;

Vector2d random_point(const Area& area, Rng& rng) {
  const double x = rng.uniform(area.min.x(), area.max.x());
  return {x, rng.uniform(area.min.y(), area.max.y())};
}

int random_contrast(int grey, int contrast, Rng& rng) {
  const int change = contrast / 2 + static_cast<int>(rng.uniform() * contrast / 2);
  const bool is_darker = grey > 215 || (grey > 40 && rng.below(2) == 0);
  return is_darker ? grey - change : grey + change;
}

void draw_polygon(Canvas& canvas, const Vector2d& centre, double size_m, int grey, Rng& rng) {
  std::array<Vector2d, 7> corners;
  const std::size_t count = 3 + rng.below(5);
  const double first = rng.uniform(0.0, 2.0 * std::numbers::pi);
  const double squeeze = rng.uniform(0.5, 1.0);
  const double tilt = rng.uniform(0.0, std::numbers::pi);
  for (std::size_t i = 0; i < count; ++i) {
    const double turn =
        (static_cast<double>(i) + rng.uniform(-0.3, 0.3)) / static_cast<double>(count);
    const double angle = first + 2.0 * std::numbers::pi * turn;
    const double radius = size_m * rng.uniform(0.35, 0.75);
    const Vector2d along(std::cos(tilt), std::sin(tilt));
    const Vector2d across(-along.y(), along.x());
    corners[i] = centre + radius * (std::cos(angle) * along + squeeze * std::sin(angle) * across);
  }
  canvas.fill_polygon(std::span(corners.data(), count), grey);
}

bool overlap(const Area& a, const Area& b, double gap) {
  return (a.min.array() < b.max.array() + gap).all() && (b.min.array() < a.max.array() + gap).all();
}

/// A sign of 3 x 5 cells, its strokes between random neighbours.
void draw_letter(Canvas& canvas, const Vector2d& corner, double height_m, int grey, Rng& rng) {
  const auto node = [&](std::uint32_t i) {
    return Vector2d(corner + height_m * 0.25 * Vector2d(i % 3, i / 3));
  };
  std::uint32_t at = rng.below(15);
  const int num_strokes = 3 + static_cast<int>(rng.below(3));
  for (int i = 0; i < num_strokes; ++i) {
    const std::uint32_t next = rng.below(15);
    const bool is_straight = next % 3 == at % 3 || next / 3 == at / 3 || rng.below(3) == 0;
    if (next != at && is_straight) {
      canvas.draw_line(node(at), node(next), height_m * 0.16, grey);
    }
    at = next;
  }
}

}  // namespace

Canvas::Canvas(const Vector2d& size_m, double texel_m, int grey)
    : image_(std::max(1, static_cast<int>(std::ceil(size_m.x() / texel_m - 1e-9))),
             std::max(1, static_cast<int>(std::ceil(size_m.y() / texel_m - 1e-9)))),
      size_m_(size_m),
      texel_m_(texel_m) {
  std::fill(image_.values.begin(), image_.values.end(), to_grey(grey));
}

void Canvas::fill_polygon(std::span<const Vector2d> corners_m, int grey) {
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

void Canvas::fill_circle(const Vector2d& centre_m, double radius_m, int grey) {
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

void Canvas::draw_line(const Vector2d& from_m, const Vector2d& to_m, double width_m, int grey) {
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

int Canvas::grey_at(const Vector2d& point_m) const {
  const int x = static_cast<int>(std::floor(point_m.x() / texel_m_));
  const int y = static_cast<int>(std::floor(point_m.y() / texel_m_));
  return image_.row(std::clamp(y, 0, image_.height_px - 1))[std::clamp(x, 0, image_.width_px - 1)];
}

void draw_polygons(
    Canvas& canvas, const Area& area, double size_m, double coverage, int contrast, Rng& rng) {
  const double square_m2 = area.size().prod();
  const int count = static_cast<int>(std::ceil(coverage * square_m2 / (size_m * size_m)));
  const bool is_small = size_m < kSmallTexels * canvas.texel_m();
  for (int i = 0; i < count; ++i) {
    const Vector2d centre = random_point(area, rng);
    const double size = size_m * rng.uniform(0.7, 1.4);
    const int grey = random_contrast(canvas.grey_at(centre), contrast, rng);
    if (is_small) {
      const Vector2d half(0.5 * size, 0.5 * size * rng.uniform(0.5, 1.0));
      canvas.fill_area({centre - half, centre + half}, grey);
    } else {
      draw_polygon(canvas, centre, size, grey, rng);
    }
  }
}

void draw_octaves(
    Canvas& canvas, const Area& area, double largest_m, double coverage, int contrast, Rng& rng) {
  for (double size = largest_m; size > 1.9 * canvas.texel_m(); size *= 0.5) {
    draw_polygons(canvas, area, size, coverage, contrast, rng);
  }
}

void draw_text(Canvas& canvas, const Area& area, double height_m, int grey, Rng& rng) {
  if (height_m < 3.0 * canvas.texel_m()) return;
  const double letter = height_m * 0.8;
  for (double y = area.min.y(); y + height_m <= area.max.y(); y += 1.7 * height_m) {
    const double end = area.max.x() - rng.uniform(0.0, 0.4) * area.size().x();
    for (double x = area.min.x(); x + letter <= end; x += letter) {
      if (rng.below(6) != 0) draw_letter(canvas, {x, y}, height_m, grey, rng);
    }
  }
}

void draw_poster(Canvas& canvas, const Area& area, Rng& rng) {
  const double side = area.size().minCoeff();
  const int paper = 60 + static_cast<int>(rng.below(180));
  const int ink = paper > 140 ? 20 + static_cast<int>(rng.below(40)) : 235;
  const Vector2d frame = Vector2d::Constant(std::max(0.04 * side, canvas.texel_m()));
  canvas.fill_area(area, ink);
  const Area inner{area.min + frame, area.max - frame};
  canvas.fill_area(inner, paper);
  const double smallest = std::max(0.045 * side, 1.9 * canvas.texel_m());
  for (double size = 0.4 * side; size > smallest; size *= 0.55) {
    const Vector2d keep = Vector2d::Constant(0.6 * size);
    if ((inner.size().array() < 2.2 * keep.array()).any()) continue;
    draw_polygons(canvas, {inner.min + keep, inner.max - keep}, size, 0.32, 110, rng);
  }
  if (rng.below(3) == 0) {
    canvas.fill_circle(
        random_point({inner.min + 0.25 * inner.size(), inner.max - 0.25 * inner.size()}, rng),
        0.12 * side,
        ink);
  }
  const double letters = rng.uniform(0.05, 0.12) * side;
  const Vector2d corner(inner.min.x() + frame.x(), inner.max.y() - 4.2 * letters);
  if (rng.below(3) != 0) draw_text(canvas, {corner, inner.max - frame}, letters, ink, rng);
}

void draw_posters(
    Canvas& canvas, const Area& area, int count, double low_m, double high_m, Rng& rng) {
  std::vector<Area> taken;
  for (int attempt = 0; attempt < 4 * count && static_cast<int>(taken.size()) < count; ++attempt) {
    const double width = rng.uniform(low_m, high_m);
    const Vector2d size(width, width * rng.uniform(0.7, 1.4));
    const Vector2d room = area.size() - size;
    if ((room.array() <= 0.0).any()) continue;
    const Vector2d corner = random_point({area.min, area.min + room}, rng);
    const Area poster{corner, corner + size};
    const bool is_free = std::none_of(taken.begin(), taken.end(), [&](const Area& other) {
      return overlap(poster, other, 0.1 * low_m);
    });
    if (!is_free) continue;
    draw_poster(canvas, poster, rng);
    taken.push_back(poster);
  }
}

void draw_clouds(Canvas& canvas, double size_m, double contrast, Rng& rng) {
  Image& image = canvas.image();
  const double step = size_m / canvas.texel_m();
  const int columns = static_cast<int>(image.width_px / step) + 2;
  const int rows = static_cast<int>(image.height_px / step) + 2;
  std::vector<float> nodes(static_cast<std::size_t>(columns * rows));
  for (float& node : nodes) node = static_cast<float>(rng.uniform(-contrast, contrast));
  for (int y = 0; y < image.height_px; ++y) {
    const float row = static_cast<float>(y / step);
    const int r = static_cast<int>(row);
    const float* top = nodes.data() + static_cast<std::ptrdiff_t>(r) * columns;
    for (int x = 0; x < image.width_px; ++x) {
      const float column = static_cast<float>(x / step);
      const int c = static_cast<int>(column);
      const float right = column - static_cast<float>(c);
      const float upper = top[c] + right * (top[c + 1] - top[c]);
      const float lower = top[columns + c] + right * (top[columns + c + 1] - top[columns + c]);
      const float value = upper + (row - static_cast<float>(r)) * (lower - upper);
      image.row(y)[x] = to_grey(image.row(y)[x] + static_cast<int>(std::lround(value)));
    }
  }
}

}  // namespace waymark

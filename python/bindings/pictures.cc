// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace waymark::python {
namespace {

constexpr double kWidthPx = 420.0;
constexpr double kHeightPx = 280.0;
constexpr double kMarginPx = 10.0;
constexpr std::size_t kMaxDrawnPoints = 1500;
constexpr std::size_t kMaxDrawnPoses = 2000;
// Of the points, on each side, that do not say how large the picture is; and how far, by what the
// others span, it goes beyond them.
constexpr double kOuterShare = 0.1;
constexpr double kBeyond = 0.3;
constexpr const char* kColors[] = {"#1f6feb", "#d1242f", "#1a7f37", "#9a6700"};

/// Axes of the picture in the world: to the right, and down.
struct Axes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  Eigen::Vector2d operator()(const Eigen::Vector3d& x) const { return {right.dot(x), down.dot(x)}; }
};

/// Looking the way that the cameras call down; ahead of the first camera is up in the picture.
Axes look_from_above(const MapPicture& picture) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const std::vector<Rigid3>& way : picture.ways) {
    for (const Rigid3& pose : way) down += pose.rotation * Eigen::Vector3d::UnitY();
  }
  if (down.norm() < 1e-6) return {};
  down.normalize();
  const Eigen::Vector3d ahead = picture.ways.front().front().rotation * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d right = down.cross(ahead);
  if (right.norm() < 1e-3) right = down.unitOrthogonal();
  right.normalize();
  return {right, -right.cross(down)};
}

/// What numbers span, where a tenth on either side may be however far out: evenly spread ones from
/// the smallest to the largest.
std::pair<double, double> robust_range(std::vector<double> numbers) {
  std::ranges::sort(numbers);
  const auto left_out = static_cast<std::size_t>(kOuterShare * static_cast<double>(numbers.size()));
  const double low = numbers[left_out], high = numbers[numbers.size() - 1 - left_out];
  const double beyond = kBeyond * (high - low);
  return {std::max(numbers.front(), low - beyond), std::min(numbers.back(), high + beyond)};
}

/// From the plane of the picture to its pixels.
struct PictureFrame {
  double px_per_unit = 1.0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const {
    return px_per_unit * (x - centre) + 0.5 * Eigen::Vector2d(kWidthPx, kHeightPx);
  }
};

PictureFrame fit_frame(const std::vector<Eigen::Vector2d>& points,
                       const std::vector<Eigen::Vector2d>& way) {
  Eigen::Vector2d low, high;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> of_points, of_way;
    for (const Eigen::Vector2d& point : points) of_points.push_back(point[axis]);
    for (const Eigen::Vector2d& point : way) of_way.push_back(point[axis]);
    if (of_points.empty()) of_points = of_way;
    if (of_way.empty()) of_way = of_points;
    const auto [way_low, way_high] = std::ranges::minmax(of_way);  // The way is seen as a whole.
    const auto [points_low, points_high] = robust_range(std::move(of_points));
    low[axis] = std::min(points_low, way_low);
    high[axis] = std::max(points_high, way_high);
  }
  const Eigen::Vector2d size = (high - low).cwiseMax(1e-9);
  const Eigen::Vector2d room(kWidthPx - 2 * kMarginPx, kHeightPx - 2 * kMarginPx);
  return {room.cwiseQuotient(size).minCoeff(), 0.5 * (low + high)};
}

/// Each n-th of many, the last always.
template <class T>
std::vector<T> thin_out(const std::vector<T>& values, std::size_t max_count) {
  const std::size_t step = values.size() / max_count + 1;
  std::vector<T> kept;
  for (std::size_t i = 0; i < values.size(); i += step) kept.push_back(values[i]);
  if (step > 1) kept.push_back(values.back());
  return kept;
}

}  // namespace

std::string draw_svg(const MapPicture& picture) {
  const Axes axes = look_from_above(picture);
  std::vector<Eigen::Vector2d> points, all_poses;
  std::vector<std::vector<Eigen::Vector2d>> ways;
  for (const Eigen::Vector3d& point : thin_out(picture.points, kMaxDrawnPoints)) {
    points.push_back(axes(point));
  }
  for (const std::vector<Rigid3>& way : picture.ways) {
    std::vector<Eigen::Vector2d>& drawn = ways.emplace_back();
    for (const Rigid3& pose : thin_out(way, kMaxDrawnPoses))
      drawn.push_back(axes(pose.translation));
    all_poses.insert(all_poses.end(), drawn.begin(), drawn.end());
  }
  if (points.empty() && all_poses.empty()) return "";
  const PictureFrame frame = fit_frame(points, all_poses);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" role=\"img\" style=\"background:#fff\">",
      kWidthPx,
      kHeightPx);
  svg += "<path stroke=\"#8c959f\" stroke-width=\"1.6\" stroke-linecap=\"round\" d=\"";
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d at = frame(point);
    const bool is_inside = at.minCoeff() >= 0.0 && at.x() <= kWidthPx && at.y() <= kHeightPx;
    if (is_inside) fmt::format_to(std::back_inserter(svg), "M{:.1f} {:.1f}h0", at.x(), at.y());
  }
  svg += "\"/>";
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const char* color = kColors[i % std::size(kColors)];
    svg +=
        fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" points=\"", color);
    for (const Eigen::Vector2d& pose : ways[i]) {
      const Eigen::Vector2d at = frame(pose);
      fmt::format_to(std::back_inserter(svg), "{:.1f},{:.1f} ", at.x(), at.y());
    }
    svg += "\"/>";
    if (ways[i].empty()) continue;
    const Eigen::Vector2d start = frame(ways[i].front());
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>", start.x(), start.y(), color);
  }
  return svg + "</svg>";
}

std::string draw_html(const MapPicture& picture, const std::string& caption) {
  return "<div>" + draw_svg(picture) + "<div>" + caption + "</div></div>";
}

}  // namespace waymark::python

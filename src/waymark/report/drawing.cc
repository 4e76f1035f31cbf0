// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "waymark/evaluate/association.h"
#include "waymark/evaluate/chart.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxPathPoints = 1500;
constexpr std::size_t kMaxCloudPoints = 4000;
constexpr double kGapIntervals = 5.0;
constexpr double kFrameMargin = 0.06;  ///< Of the extent, around what is drawn.
/// Of the points on either side that are not asked for: some are always far off.
constexpr double kStrayPart = 0.02;

// Small, so that text is large where it is shrunk to a phone's width.
constexpr int kWidth = 420;
constexpr int kPathHeight = 372;
constexpr int kCurveHeight = 262;
constexpr Chart::Frame kViewFrame{60, 10, 350, 310};
constexpr Chart::Frame kCurveFrame{60, 10, 350, 200};

constexpr double kTimelineHeight = 100.0;

std::string axis_name(int axis, double sign) {
  return std::string(sign < 0.0 ? "-" : "") + "xyz"[axis];
}

std::string svg_head(int width, int height, const std::string& title) {
  return fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
                     width,
                     height,
                     escape_xml(title));
}

/// What can be seen of some values.
AxisRange range_along(const std::vector<DrawnPath>& paths, const Eigen::Vector3d& direction) {
  AxisRange range{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
  for (const DrawnPath& path : paths) {
    for (const Eigen::Vector3d& position : path.positions) {
      range.low = std::min(range.low, direction.dot(position));
      range.high = std::max(range.high, direction.dot(position));
    }
  }
  return range;
}

/// Widens a range to most of the points, but not to those that are too far off.
AxisRange with_cloud(AxisRange range,
                     const std::vector<Eigen::Vector3f>& points,
                     const Eigen::Vector3d& direction,
                     double margin) {
  if (points.empty()) return range;
  std::vector<double> along;
  for (const Eigen::Vector3f& point : points) along.push_back(direction.dot(point.cast<double>()));
  std::ranges::sort(along);
  const auto stray = static_cast<std::size_t>(kStrayPart * static_cast<double>(along.size()));
  range.low = std::min(range.low, std::max(along[stray], range.low - margin));
  range.high = std::max(range.high, std::min(along[along.size() - 1 - stray], range.high + margin));
  return range;
}

AxisRange framed(const AxisRange& range) {
  const double margin = std::max(kFrameMargin * range.extent(), 1e-3);
  return {range.low - margin, range.high + margin};
}

ChartPoint projected(const Eigen::Vector3d& position, const ViewAxes& axes, bool starts_stroke) {
  return {axes.right.dot(position), axes.up.dot(position), starts_stroke};
}

/// Dots: strokes of no length with round ends.
std::vector<ChartPoint> cloud_of(const PathDrawing& drawing,
                                 const ViewAxes& axes,
                                 const AxisRange& x,
                                 const AxisRange& y) {
  std::vector<ChartPoint> dots;
  const std::size_t step = drawing.points.size() / kMaxCloudPoints + 1;
  for (std::size_t i = 0; i < drawing.points.size(); i += step) {
    ChartPoint dot = projected(drawing.points[i].cast<double>(), axes, true);
    if (dot.x < x.low || dot.x > x.high || dot.y < y.low || dot.y > y.high) continue;
    dots.push_back(dot);
    dot.starts_stroke = false;
    dots.push_back(dot);
  }
  return dots;
}

}  // namespace

std::array<ViewAxes, 2> choose_views(std::span<const StampedPose> poses) {
  Eigen::Vector3d camera_up = Eigen::Vector3d::Zero();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d high = -low;
  for (const StampedPose& pose : poses) {
    const Rigid3& world_from_camera = pose.world_from_camera;
    camera_up -= world_from_camera.rotation * Eigen::Vector3d::UnitY();
    low = low.cwiseMin(world_from_camera.translation);
    high = high.cwiseMax(world_from_camera.translation);
  }
  int up_axis = 1;  // The first camera's y is down.
  double up_sign = -1.0;
  if (camera_up.cwiseAbs().maxCoeff(&up_axis) > 0.0)
    up_sign = camera_up[up_axis] < 0.0 ? -1.0 : 1.0;
  const int across = up_axis == 0 ? 1 : 0;
  const int along = 3 - up_axis - across;
  // Seen from above, right and forward on the page and up towards the eye are right-handed.
  const Eigen::Vector3d up = up_sign * Eigen::Vector3d::Unit(up_axis);
  const Eigen::Vector3d right = Eigen::Vector3d::Unit(across);
  const Eigen::Vector3d forward = up.cross(right);
  const double forward_sign = forward[along] < 0.0 ? -1.0 : 1.0;
  const ViewAxes above{right, forward, axis_name(across, 1.0), axis_name(along, forward_sign)};
  const bool is_longer_across =
      poses.empty() || high[across] - low[across] >= high[along] - low[along];
  const int side = is_longer_across ? across : along;
  const ViewAxes from_side{
      Eigen::Vector3d::Unit(side), up, axis_name(side, 1.0), axis_name(up_axis, up_sign)};
  return {above, from_side};
}

DrawnPath path_of(std::span<const StampedPose> poses,
                  const Sim3& drawn_from_world,
                  std::string style) {
  DrawnPath path;
  path.style = std::move(style);
  const std::size_t step = poses.size() / kMaxPathPoints + 1;
  const double max_gap_ns = kGapIntervals * static_cast<double>(median_interval_ns(poses));
  bool is_after_gap = false;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i > 0) {
      const double gap_ns = static_cast<double>(poses[i].timestamp_ns) -
                            static_cast<double>(poses[i - 1].timestamp_ns);
      is_after_gap = is_after_gap || gap_ns > max_gap_ns;
    }
    if (i % step != 0 && i + 1 != poses.size()) continue;
    path.positions.push_back(drawn_from_world * poses[i].world_from_camera.translation);
    path.starts_stroke.push_back(is_after_gap);
    is_after_gap = false;
  }
  return path;
}

std::string draw_paths(const PathDrawing& drawing, const ViewAxes& axes) {
  AxisRange x = range_along(drawing.paths, axes.right);
  AxisRange y = range_along(drawing.paths, axes.up);
  const double extent = std::max(x.extent(), y.extent());
  if (!(extent >= 0.0) || !std::isfinite(extent)) return "<p>There is no path to draw.</p>\n";
  const double margin = drawing.cloud_margin * extent;
  x = framed(with_cloud(x, drawing.points, axes.right, margin));
  y = framed(with_cloud(y, drawing.points, axes.up, margin));
  Chart::make_isometric(kViewFrame, x, y);
  const Chart chart(kViewFrame, x, y);
  std::string svg = svg_head(kWidth, kPathHeight, drawing.title);
  svg += chart.axes(fmt::format("{} [{}]", axes.right_name, drawing.unit),
                    fmt::format("{} [{}]", axes.up_name, drawing.unit));
  svg += chart.line(cloud_of(drawing, axes, x, y), "class=\"cloud\"");
  for (const DrawnPath& path : drawing.paths) {
    std::vector<ChartPoint> line;
    for (std::size_t i = 0; i < path.positions.size(); ++i) {
      line.push_back(projected(path.positions[i], axes, path.starts_stroke[i]));
    }
    svg += chart.line(line, path.style);
  }
  for (const DrawnMark& mark : drawing.marks) {
    svg += chart.dot(projected(mark.position, axes, false), mark.style);
  }
  return svg + "</svg>\n";
}

std::string draw_curve(const DrawnCurve& curve) {
  std::vector<ChartPoint> points;
  const std::size_t step = curve.y.size() / kMaxPathPoints + 1;
  double top = 0.0;
  for (std::size_t begin = 0; begin < curve.y.size(); begin += step) {
    const auto first = curve.y.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last =
        curve.y.begin() + static_cast<std::ptrdiff_t>(std::min(begin + step, curve.y.size()));
    const auto largest = std::max_element(first, last);
    const auto at = static_cast<std::size_t>(largest - curve.y.begin());
    const auto begins = curve.starts_stroke.begin() + (first - curve.y.begin());
    const bool is_after_gap =
        std::find(begins, begins + (last - first), true) != begins + (last - first);
    points.push_back({curve.x[at], *largest, is_after_gap});
    top = std::max(top, *largest);
  }
  if (points.empty() || !std::isfinite(top)) return "<p>There is nothing to draw.</p>\n";
  const AxisRange x{points.front().x, std::max(points.back().x, points.front().x + 1e-6)};
  const AxisRange y{0.0, std::max(top * (1.0 + kFrameMargin), 1e-6)};
  const Chart chart(kCurveFrame, x, y);
  return svg_head(kWidth, kCurveHeight, curve.title) + chart.axes(curve.x_label, "") +
         chart.line(points, "class=\"error\"") + "</svg>\n";
}

std::string draw_timeline(std::span<const TimelineLine> lines,
                          double top,
                          const std::string& title) {
  const std::size_t num_columns = lines.empty() ? 0 : lines.front().values.size();
  std::string svg = fmt::format(
      "<svg class=\"track\" viewBox=\"0 0 {} {:.0f}\" preserveAspectRatio=\"none\" role=\"img\" "
      "aria-label=\"{}\">\n",
      std::max<std::size_t>(num_columns, 1),
      kTimelineHeight,
      escape_xml(title));
  auto out = std::back_inserter(svg);
  for (const TimelineLine& line : lines) {
    fmt::format_to(out, "<path class=\"{}\" d=\"", line.style);
    bool is_open = false;
    for (std::size_t i = 0; i < line.values.size(); ++i) {
      const double value = line.values[i];
      const bool has_value = std::isfinite(value);
      if (has_value) {
        const double y =
            kTimelineHeight * (1.0 - std::clamp(value / std::max(top, 1e-9), 0.0, 1.0));
        // A value by itself is drawn as wide as its column.
        if (!is_open) fmt::format_to(out, "M{} {:.1f}", i, y);
        fmt::format_to(out, "L{}.5 {:.1f}", i, y);
      } else if (is_open) {
        svg += "h.5";
      }
      is_open = has_value;
    }
    svg += is_open ? "h.5\"/>\n" : "\"/>\n";
  }
  return svg + "</svg>\n";
}

std::string draw_strip(std::span<const std::string> styles, const std::string& title) {
  std::string svg = fmt::format(
      "<svg class=\"strip\" viewBox=\"0 0 {} 1\" preserveAspectRatio=\"none\" role=\"img\" "
      "aria-label=\"{}\">\n",
      std::max<std::size_t>(styles.size(), 1),
      escape_xml(title));
  for (std::size_t begin = 0; begin < styles.size();) {
    std::size_t end = begin + 1;
    while (end < styles.size() && styles[end] == styles[begin]) ++end;
    if (!styles[begin].empty()) {
      svg += fmt::format("<rect class=\"{}\" x=\"{}\" width=\"{}\" height=\"1\"/>\n",
                         styles[begin],
                         begin,
                         end - begin);
    }
    begin = end;
  }
  return svg + "</svg>\n";
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "waymark/evaluate/association.h"
#include "waymark/evaluate/chart.h"
#include "waymark/evaluate/report.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxPoints = 2000;
constexpr double kPlotGapIntervals = 5.0;
constexpr double kMargin = 0.05;  // Of the extent, around the data.
constexpr Chart::Frame kMapFrame{70, 70, 400, 330};
constexpr Chart::Frame kErrorFrame{570, 70, 400, 330};
constexpr std::array<const char*, 3> kAxisNames = {"x [m]", "y [m]", "z [m]"};

constexpr const char* kHead =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1000 460\" width=\"1000\" "
    "height=\"460\">\n"
    "<style>text{font:12px sans-serif;fill:#444}.title{font-size:15px;fill:#111}"
    ".middle{text-anchor:middle}.end{text-anchor:end}"
    "path{fill:none;stroke-linejoin:round}.grid{stroke:#e8e8e8}.axis{stroke:#888}"
    ".truth{stroke:#9a9a9a;stroke-width:3}.estimate{stroke:#0b62c4;stroke-width:1.5}"
    ".error{stroke:#c2410c;stroke-width:1.5}.rmse{stroke:#888;stroke-dasharray:5 4}"
    ".start{fill:#0b62c4}</style>\n"
    "<rect width=\"1000\" height=\"460\" fill=\"#fff\"/>\n";

/// Two of the three axes, horizontal and vertical in the plot.
struct Plane {
  int horizontal = 0;
  int vertical = 1;
};

struct Path {
  std::vector<Eigen::Vector3d> points;
  std::vector<bool> starts_stroke;
};

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

/// A longer time between successive poses is drawn as a gap.
double max_gap_of(std::span<const StampedPose> poses) {
  return 1e-9 * kPlotGapIntervals * static_cast<double>(median_interval_ns(poses));
}

/// At most kMaxPoints positions, the last one included; strokes break where poses are missing.
Path thin_out(std::span<const StampedPose> poses, const Sim3& to_groundtruth) {
  Path path;
  const std::size_t step = poses.size() / kMaxPoints + 1;
  const double max_gap_s = max_gap_of(poses);
  bool is_after_gap = false;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i > 0) {
      const double gap_s = seconds_between(poses[i - 1].timestamp_ns, poses[i].timestamp_ns);
      is_after_gap = is_after_gap || gap_s > max_gap_s;
    }
    if (i % step != 0 && i + 1 != poses.size() && !is_after_gap) continue;
    path.points.push_back(to_groundtruth * poses[i].world_from_camera.translation);
    path.starts_stroke.push_back(is_after_gap);
    is_after_gap = false;
  }
  return path;
}

AxisRange range_of(const Path& a, const Path& b, int axis) {
  AxisRange range{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
  for (const Path* path : {&a, &b}) {
    for (const Eigen::Vector3d& point : path->points) {
      range.low = std::min(range.low, point[axis]);
      range.high = std::max(range.high, point[axis]);
    }
  }
  return range;
}

AxisRange with_margin(const AxisRange& range) {
  const double margin = std::max(kMargin * range.extent(), 1e-3);
  return {range.low - margin, range.high + margin};
}

/// The plane without the axis of the smallest extent.
Plane choose_plane(const std::array<AxisRange, 3>& ranges) {
  int smallest = 2;
  for (int axis : {1, 0}) {
    if (ranges[static_cast<std::size_t>(axis)].extent() <
        ranges[static_cast<std::size_t>(smallest)].extent())
      smallest = axis;
  }
  if (smallest == 2) return {0, 1};
  return smallest == 1 ? Plane{0, 2} : Plane{1, 2};
}

std::vector<ChartPoint> project(const Path& path, const Plane& plane) {
  std::vector<ChartPoint> points;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    points.push_back(
        {path.points[i][plane.horizontal], path.points[i][plane.vertical], path.starts_stroke[i]});
  }
  return points;
}

std::string draw_map(const Path& truth, const Path& estimate) {
  const std::array<AxisRange, 3> ranges = {
      range_of(truth, estimate, 0), range_of(truth, estimate, 1), range_of(truth, estimate, 2)};
  const Plane plane = choose_plane(ranges);
  AxisRange x = with_margin(ranges[static_cast<std::size_t>(plane.horizontal)]);
  AxisRange y = with_margin(ranges[static_cast<std::size_t>(plane.vertical)]);
  Chart::make_isometric(kMapFrame, x, y);
  const Chart chart(kMapFrame, x, y);
  std::string svg = chart.axes(kAxisNames[static_cast<std::size_t>(plane.horizontal)],
                               kAxisNames[static_cast<std::size_t>(plane.vertical)]);
  const std::vector<ChartPoint> estimate_points = project(estimate, plane);
  svg += chart.line(project(truth, plane), "class=\"truth\"");
  svg += chart.line(estimate_points, "class=\"estimate\"");
  if (!estimate_points.empty()) svg += chart.dot(estimate_points.front(), "class=\"start\"");
  return svg;
}

/// The largest error of each of at most kMaxPoints stretches, so that no peak is lost; strokes
/// break where poses are missing.
std::vector<ChartPoint> error_points(const std::vector<PositionError>& errors, double max_gap_s) {
  std::vector<ChartPoint> points;
  const std::size_t step = errors.size() / kMaxPoints + 1;
  std::int64_t last_ns = errors.front().timestamp_ns;
  for (std::size_t begin = 0; begin < errors.size(); begin += step) {
    const std::size_t end = std::min(begin + step, errors.size());
    std::size_t largest = begin;
    bool is_after_gap = false;
    for (std::size_t i = begin; i < end; ++i) {
      if (errors[i].error_m > errors[largest].error_m) largest = i;
      is_after_gap = is_after_gap || seconds_between(last_ns, errors[i].timestamp_ns) > max_gap_s;
      last_ns = errors[i].timestamp_ns;
    }
    const double time_s =
        seconds_between(errors.front().timestamp_ns, errors[largest].timestamp_ns);
    points.push_back({time_s, errors[largest].error_m, is_after_gap});
  }
  return points;
}

std::string draw_error(const Evaluation& evaluation, double max_gap_s) {
  const std::vector<ChartPoint> points = error_points(evaluation.errors, max_gap_s);
  const AxisRange time{0.0, std::max(points.back().x, 1e-3)};
  const AxisRange error{0.0, std::max(evaluation.ate_m.max * (1.0 + kMargin), 1e-6)};
  const Chart chart(kErrorFrame, time, error);
  std::string svg = chart.axes(evaluation.is_by_line ? "line" : "time [s]", "position error [m]");
  svg += chart.line(points, "class=\"error\"");
  svg += chart.line({{time.low, evaluation.ate_m.rmse}, {time.high, evaluation.ate_m.rmse}},
                    "class=\"rmse\"");
  return svg;
}

std::string legend_entry(double x_px, std::string_view style, std::string_view text) {
  return fmt::format(
      "<path class=\"{}\" d=\"M{:.0f} 55h26\"/><text x=\"{:.0f}\" y=\"59\">{}</text>\n",
      style,
      x_px,
      x_px + 32,
      escape_xml(text));
}

}  // namespace

std::string plot_evaluation(const Evaluation& evaluation,
                            std::span<const StampedPose> estimate,
                            std::span<const StampedPose> groundtruth,
                            std::string_view title) {
  const Path truth_path = thin_out(groundtruth, Sim3());
  const Path estimate_path = thin_out(estimate, evaluation.groundtruth_from_estimate);
  std::string svg = kHead;
  svg += fmt::format("<text class=\"title\" x=\"70\" y=\"28\">{}</text>\n", escape_xml(title));
  svg += draw_map(truth_path, estimate_path);
  svg += draw_error(evaluation, max_gap_of(estimate));
  svg += legend_entry(70, "truth", "ground truth");
  svg += legend_entry(
      190,
      "estimate",
      fmt::format("estimate, aligned ({}), dot: start", to_string(evaluation.alignment)));
  svg += legend_entry(570, "error", "error");
  svg += legend_entry(650, "rmse", fmt::format("rmse {:.4g} m", evaluation.ate_m.rmse));
  return svg + "</svg>\n";
}

}  // namespace waymark

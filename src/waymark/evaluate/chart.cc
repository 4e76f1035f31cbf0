// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace waymark {
namespace {

constexpr std::size_t kMaxTicks = 8;

double tick_step(double extent, std::size_t max_ticks) {
  const double rough = extent / static_cast<double>(max_ticks);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10.0 * power;
}

}  // namespace

std::vector<double> axis_ticks(const AxisRange& range, std::size_t max_ticks) {
  std::vector<double> ticks;
  if (!(range.extent() > 0.0) || max_ticks == 0) return ticks;
  const double step = tick_step(range.extent(), max_ticks);
  const double first = std::ceil(range.low / step);
  // Beyond the precision of a double a step changes nothing.
  if (!(step > 0.0) || range.low + step == range.low) return ticks;
  for (std::size_t i = 0; i <= max_ticks; ++i) {
    const double tick = (first + static_cast<double>(i)) * step;
    if (tick > range.high) break;
    ticks.push_back(tick == 0.0 ? 0.0 : tick);  // Not -0.
  }
  return ticks;
}

void Chart::make_isometric(const Frame& frame, AxisRange& x, AxisRange& y) {
  const double units_per_px = std::max(x.extent() / frame.width_px, y.extent() / frame.height_px);
  const auto widen = [](AxisRange& range, double extent) {
    const double middle = 0.5 * (range.low + range.high);
    range = {middle - 0.5 * extent, middle + 0.5 * extent};
  };
  widen(x, units_per_px * frame.width_px);
  widen(y, units_per_px * frame.height_px);
}

double Chart::to_px_x(double x) const {
  return frame_.left_px + (x - x_.low) / x_.extent() * frame_.width_px;
}

double Chart::to_px_y(double y) const {
  return frame_.top_px + (y_.high - y) / y_.extent() * frame_.height_px;
}

std::string Chart::axes(std::string_view x_label, std::string_view y_label) const {
  const double bottom = frame_.top_px + frame_.height_px;
  const double right = frame_.left_px + frame_.width_px;
  std::string svg;
  auto out = std::back_inserter(svg);
  for (double tick : axis_ticks(x_, kMaxTicks)) {
    const double x = to_px_x(tick);
    fmt::format_to(
        out, "<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>", x, frame_.top_px, bottom);
    fmt::format_to(out,
                   "<text class=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{:g}</text>\n",
                   x,
                   bottom + 17,
                   tick);
  }
  for (double tick : axis_ticks(y_, kMaxTicks)) {
    const double y = to_px_y(tick);
    fmt::format_to(
        out, "<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", frame_.left_px, y, right);
    fmt::format_to(out,
                   "<text class=\"end\" x=\"{:.1f}\" y=\"{:.1f}\">{:g}</text>\n",
                   frame_.left_px - 7,
                   y + 4,
                   tick);
  }
  fmt::format_to(out,
                 "<path class=\"axis\" d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\"/>\n",
                 frame_.left_px,
                 frame_.top_px,
                 bottom,
                 right);
  fmt::format_to(out,
                 "<text class=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                 0.5 * (frame_.left_px + right),
                 bottom + 38,
                 escape_xml(x_label));
  const double label_x = frame_.left_px - 48;
  const double label_y = 0.5 * (frame_.top_px + bottom);
  fmt::format_to(
      out,
      "<text class=\"middle\" transform=\"translate({:.1f} {:.1f})rotate(-90)\">{}</text>\n",
      label_x,
      label_y,
      escape_xml(y_label));
  return svg;
}

std::string Chart::line(const std::vector<ChartPoint>& points, std::string_view style) const {
  if (points.empty()) return {};
  std::string svg = fmt::format("<path {} d=\"", style);
  auto out = std::back_inserter(svg);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const char command = i == 0 || points[i].starts_stroke ? 'M' : 'L';
    fmt::format_to(out, "{}{:.1f} {:.1f}", command, to_px_x(points[i].x), to_px_y(points[i].y));
  }
  return svg + "\"/>\n";
}

std::string Chart::dot(const ChartPoint& point, std::string_view style) const {
  return fmt::format("<circle {} cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>\n",
                     style,
                     to_px_x(point.x),
                     to_px_y(point.y));
}

std::string escape_xml(std::string_view text) {
  std::string escaped;
  for (char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

}  // namespace waymark

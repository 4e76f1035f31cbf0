// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// A range of values on an axis.
struct AxisRange {
  double low = 0.0;
  double high = 0.0;

  double extent() const { return high - low; }
};

/// Round values within the range, about so many at most: multiples of 1, 2 or 5 times a power
/// of 10.
std::vector<double> axis_ticks(const AxisRange& range, std::size_t max_ticks);

/// A point of a line; a break starts a new stroke.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  bool starts_stroke = false;
};

/// Draws lines into a rectangle of an SVG image, with axes, grid and labels. y grows upwards.
class Chart {
 public:
  struct Frame {
    double left_px = 0.0;
    double top_px = 0.0;
    double width_px = 0.0;
    double height_px = 0.0;
  };

  Chart(Frame frame, AxisRange x, AxisRange y) : frame_(frame), x_(x), y_(y) {}

  /// Widens one of two ranges around its middle, so that both have the same scale in the frame.
  static void make_isometric(const Frame& frame, AxisRange& x, AxisRange& y);

  std::string axes(std::string_view x_label, std::string_view y_label) const;
  /// style holds SVG attributes of the stroke.
  std::string line(const std::vector<ChartPoint>& points, std::string_view style) const;
  std::string dot(const ChartPoint& point, std::string_view style) const;

 private:
  double to_px_x(double x) const;
  double to_px_y(double y) const;

  Frame frame_;
  AxisRange x_;
  AxisRange y_;
};

/// Text for use inside an SVG element.
std::string escape_xml(std::string_view text);

}  // namespace waymark

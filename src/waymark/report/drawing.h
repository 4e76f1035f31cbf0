// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/evaluate/evaluation.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// A direction to look at a path from, by axes of its world.
struct ViewAxes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< On the page.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< The same.
  std::string right_name;                            ///< For example "x" or "-y".
  std::string up_name;                               ///< The same.
};

/// From above, and from the side on which the path is longer. Up is the axis of the world that is
/// nearest to what was up for the camera, which is carried upright more often than not.
std::array<ViewAxes, 2> choose_views(std::span<const StampedPose> poses);

/// A line through positions.
struct DrawnPath {
  std::vector<Eigen::Vector3d> positions;
  std::vector<bool> starts_stroke;  ///< Per position; true where poses before it are missing.
  std::string style;                ///< Attributes of the line in SVG.
};

/// The path of poses, each moved, thinned out to what can be seen.
DrawnPath path_of(std::span<const StampedPose> poses,
                  const Sim3& drawn_from_world,
                  std::string style);

/// A place on a path.
struct DrawnMark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::string style;  ///< Attributes of the dot in SVG.
};

/// What is drawn in one view, later things over earlier ones.
struct PathDrawing {
  std::vector<Eigen::Vector3f> points;  ///< Of the map.
  /// Points further from the paths are left out, in extents of these.
  double cloud_margin = 1.0;
  std::vector<DrawnPath> paths;
  std::vector<DrawnMark> marks;
  std::string unit;   ///< Of lengths, for the axes.
  std::string title;  ///< For those who cannot see it.
};

/// An SVG element as wide as what it is in; a sentence where there is no path.
std::string draw_paths(const PathDrawing& drawing, const ViewAxes& axes);

/// Values over an axis.
struct DrawnCurve {
  std::vector<double> x;            ///< Ascending.
  std::vector<double> y;            ///< Not negative.
  std::vector<bool> starts_stroke;  ///< Per value; true where values before it are missing.
  std::string x_label;
  std::string title;  ///< For those who cannot see it.
};

/// The same with values from 0 on; peaks stay where values are thinned out.
std::string draw_curve(const DrawnCurve& curve);

/// One value per column of a timeline; NaN: none.
using TimelineValues = std::vector<double>;

/// A line of a timeline.
struct TimelineLine {
  TimelineValues values;
  std::string style;  ///< A class of the page's style.
};

/// Lines over the columns of a timeline, from 0 to `top`, without text: as wide as what it is in.
std::string draw_timeline(std::span<const TimelineLine> lines,
                          double top,
                          const std::string& title);

/// A class of the page's style per column, as a strip; empty: nothing there.
std::string draw_strip(std::span<const std::string> styles, const std::string& title);

}  // namespace waymark

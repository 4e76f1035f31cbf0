// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "waymark/image/image.h"

namespace waymark {

/// A rectangle on a canvas in metres, u to the right and v down.
struct Area {
  Eigen::Vector2d min = Eigen::Vector2d::Zero();
  Eigen::Vector2d max = Eigen::Vector2d::Zero();

  Eigen::Vector2d size() const { return max - min; }
};

/// A grey image of a surface to draw on, in metres. What lies outside is cut off; greys are clamped
/// to 0..255.
class Canvas {
 public:
  Canvas(const Eigen::Vector2d& size_m, double texel_m, int grey);

  void fill_polygon(std::span<const Eigen::Vector2d> corners_m, int grey);
  void fill_circle(const Eigen::Vector2d& centre_m, double radius_m, int grey);
  /// Edges fall on texel boundaries.
  void fill_area(const Area& area_m, int grey);
  void draw_line(const Eigen::Vector2d& from_m,
                 const Eigen::Vector2d& to_m,
                 double width_m,
                 int grey);

  int grey_at(const Eigen::Vector2d& point_m) const;
  double texel_m() const { return texel_m_; }
  Area area() const { return {Eigen::Vector2d::Zero(), size_m_}; }
  Image& image() { return image_; }

 private:
  Image image_;
  Eigen::Vector2d size_m_;
  double texel_m_;
};

}  // namespace waymark

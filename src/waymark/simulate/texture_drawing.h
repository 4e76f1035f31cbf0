// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "waymark/base/rng.h"
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

/// Random things to see, drawn on part of a canvas. Everything is drawn once and irregularly, so
/// that no two places look alike.

/// Polygons of about size_m that cover about a share coverage of the area; each differs from what
/// is below it by contrast/2..contrast grey levels.
void draw_polygons(
    Canvas& canvas, const Area& area, double size_m, double coverage, int contrast, Rng& rng);

/// Polygons of all sizes from largest_m down to two texels, an octave apart: corners at any viewing
/// distance.
void draw_octaves(
    Canvas& canvas, const Area& area, double largest_m, double coverage, int contrast, Rng& rng);

/// Rows of marks that look like text, letters height_m high, until the area is full.
void draw_text(Canvas& canvas, const Area& area, double height_m, int grey, Rng& rng);

/// A framed picture: polygons of all sizes, discs and some text.
void draw_poster(Canvas& canvas, const Area& area, Rng& rng);

/// Up to count posters of sides low_m..high_m that do not overlap, and keep off the border.
void draw_posters(
    Canvas& canvas, const Area& area, int count, double low_m, double high_m, Rng& rng);

/// Smooth light and dark clouds of about size_m, +-contrast.
void draw_clouds(Canvas& canvas, double size_m, double contrast, Rng& rng);

/// What a surface looks like. All styles have marks of all sizes; kBare has next to none, kBlank is
/// of one grey.
enum class Style : std::uint8_t {
  kWall,
  kBare,
  kBlank,
  kFloor,
  kTiles,
  kCeiling,
  kBooks,
  kCrate,
  kPicture,
  kFacade,
  kRoad,
  kPavement,
  kFoliage,
  kMetal,
};

/// A picture of the style for a surface of this size, v pointing down.
Image paint(Style style, const Eigen::Vector2d& size_m, double texel_m, Rng& rng);

}  // namespace waymark

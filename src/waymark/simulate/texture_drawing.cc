// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/texture_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace waymark {
namespace {

using Eigen::Vector2d;

int between(int low, int high, Rng& rng) {
  return low + static_cast<int>(rng.below(static_cast<std::uint32_t>(high - low + 1)));
}

/// Fills an area with pieces of size piece_m, each in its own shade, rows shifted against each
/// other, with gaps of gap_m.
struct Pieces {
  Vector2d size_m;
  double gap_m;
  int darkest;
  int lightest;
  bool is_staggered;
};

void lay_pieces(Canvas& canvas, const Area& area, const Pieces& pieces, Rng& rng) {
  for (double y = area.min.y(); y < area.max.y(); y += pieces.size_m.y()) {
    const double shift = pieces.is_staggered ? rng.uniform(0.0, pieces.size_m.x()) : 0.0;
    for (double x = area.min.x() - shift; x < area.max.x(); x += pieces.size_m.x()) {
      const Vector2d corner(std::max(x, area.min.x()), y);
      const Vector2d end =
          (Vector2d(x, y) + pieces.size_m - Vector2d::Constant(pieces.gap_m)).cwiseMin(area.max);
      if ((end.array() <= corner.array()).any()) continue;
      canvas.fill_area({corner, end}, between(pieces.darkest, pieces.lightest, rng));
    }
  }
}

void paint_wall(Canvas& canvas, const Area& area, Rng& rng) {
  const Vector2d size = area.size();
  canvas.fill_area(area, between(140, 190, rng));
  draw_octaves(canvas, area, 0.2, 0.06, 40, rng);
  draw_polygons(canvas, area, 0.04, 0.06, 60, rng);
  const int num_posters = static_cast<int>(std::ceil(0.8 * size.prod()));
  draw_posters(canvas, area, num_posters, 0.25, 0.8, rng);
  canvas.fill_area({{0.0, size.y() - 0.08}, size}, 70);
  draw_clouds(canvas, 1.0, 14.0, rng);
}

void paint_bare(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, between(120, 190, rng));
  draw_polygons(canvas, area, 0.05, 0.004, 60, rng);
  draw_polygons(canvas, area, 0.02, 0.002, 70, rng);
  draw_clouds(canvas, 1.0, 14.0, rng);
}

void paint_blank(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, between(110, 200, rng));
}

void paint_floor(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 45);
  lay_pieces(canvas, area, {{1.1, 0.14}, 0.006, 95, 150, true}, rng);
  draw_octaves(canvas, area, 0.12, 0.05, 40, rng);
  draw_posters(canvas, area, static_cast<int>(area.size().prod() / 8.0), 0.6, 1.4, rng);
  draw_clouds(canvas, 0.8, 12.0, rng);
}

void paint_tiles(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 60);
  lay_pieces(canvas, area, {{0.4, 0.4}, 0.015, 90, 170, false}, rng);
  draw_octaves(canvas, area, 0.3, 0.08, 50, rng);
  draw_clouds(canvas, 1.5, 12.0, rng);
}

void paint_ceiling(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 120);
  lay_pieces(canvas, area, {{0.62, 0.62}, 0.02, 175, 205, false}, rng);
  draw_octaves(canvas, area, 0.08, 0.035, 45, rng);
  for (double y = 0.9; y + 0.3 < area.max.y(); y += 1.86) {
    for (double x = 0.62; x + 0.62 < area.max.x(); x += 1.86) {
      if (rng.below(3) != 0) canvas.fill_area({{x, y}, {x + 0.6, y + 0.3}}, 250);
    }
  }
}

void paint_books(Canvas& canvas, const Area& area, Rng& rng) {
  constexpr double kShelf = 0.34;
  canvas.fill_area(area, 35);
  for (double y = 0.0; y < area.max.y(); y += kShelf) {
    for (double x = 0.02; x < area.max.x() - 0.02;) {
      const double width = rng.uniform(0.02, 0.07);
      const double height = rng.uniform(0.55, 0.9) * kShelf;
      const Area book{{x, y + kShelf - 0.025 - height}, {x + width - 0.004, y + kShelf - 0.025}};
      if (rng.below(9) != 0) {
        const int cover = between(50, 225, rng);
        canvas.fill_area(book, cover);
        const double band = book.min.y() + rng.uniform(0.05, 0.3) * height;
        canvas.fill_area({{x, band}, {book.max.x(), band + rng.uniform(0.02, 0.05)}},
                         cover > 130 ? cover - 70 : cover + 70);
        draw_text(
            canvas, {book.min + Vector2d(0.004, 0.1), book.max}, 0.02, cover > 130 ? 20 : 235, rng);
      }
      x += width;
    }
    canvas.fill_area({{0.0, y + kShelf - 0.025}, {area.max.x(), y + kShelf}}, 110);
  }
}

void paint_crate(Canvas& canvas, const Area& area, Rng& rng) {
  const double side = area.size().minCoeff();
  canvas.fill_area(area, 50);
  lay_pieces(canvas, area, {{area.size().x(), 0.16}, 0.008, 105, 175, false}, rng);
  draw_octaves(canvas, area, 0.5 * side, 0.06, 50, rng);
  draw_posters(
      canvas, area, 1 + static_cast<int>(3.0 * area.size().prod()), 0.3 * side, 0.6 * side, rng);
}

void paint_metal(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, between(60, 190, rng));
  draw_octaves(canvas, area, 0.4 * area.size().minCoeff(), 0.09, 60, rng);
  const double height = std::min(0.08, 0.15 * area.size().y());
  const double top = rng.uniform(0.3, 0.5) * area.size().y();
  draw_text(canvas, {{0.0, top}, {area.max.x(), top + 2.0 * height}}, height, 15, rng);
  draw_clouds(canvas, 0.5, 15.0, rng);
}

void paint_window(Canvas& canvas, const Area& area, Rng& rng) {
  const Vector2d frame = Vector2d::Constant(0.1);
  canvas.fill_area(area, between(190, 240, rng));
  const Area glass{area.min + frame, area.max - frame};
  canvas.fill_area(glass, between(25, 90, rng));
  draw_polygons(canvas, glass, 0.4, 0.3, 60, rng);
  draw_polygons(canvas, glass, 0.12, 0.15, 60, rng);
  const double middle = 0.5 * (area.min.x() + area.max.x());
  canvas.fill_area({{middle - 0.04, area.min.y()}, {middle + 0.04, area.max.y()}}, 215);
}

void paint_facade(Canvas& canvas, const Area& area, Rng& rng) {
  const int shade = between(95, 170, rng);
  canvas.fill_area(area, shade - 35);
  lay_pieces(canvas, area, {{0.55, 0.22}, 0.03, shade - 18, shade + 22, true}, rng);
  draw_octaves(canvas, area, 0.9, 0.035, 55, rng);
  const double spacing = rng.uniform(2.0, 2.8);
  for (double y = area.max.y() - 6.0; y > -1.5; y -= 3.0) {
    for (double x = rng.uniform(0.4, 0.8); x + 1.3 < area.max.x(); x += spacing) {
      if (rng.below(8) != 0) paint_window(canvas, {{x, y}, {x + 1.3, y + 1.7}}, rng);
    }
  }
  const Area shop{{0.3, std::max(area.max.y() - 2.8, 0.0)},
                  {area.max.x() - 0.3, area.max.y() - 0.2}};
  draw_posters(canvas, shop, static_cast<int>(area.size().x()), 0.9, 2.2, rng);
}

void paint_road(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 95);
  draw_polygons(canvas, area, 1.2, 0.15, 26, rng);
  draw_octaves(canvas, area, 0.6, 0.05, 55, rng);
  const bool is_wide = area.size().x() > area.size().y();
  const int along = is_wide ? 0 : 1;
  const double middle = 0.5 * area.size()[1 - along];
  for (double s = 0.5; s + 2.0 < area.size()[along]; s += 4.0) {
    Area dash;
    dash.min[along] = s;
    dash.max[along] = s + rng.uniform(1.6, 2.4);
    dash.min[1 - along] = middle - 0.08;
    dash.max[1 - along] = middle + 0.08;
    canvas.fill_area(dash, between(205, 235, rng));
  }
  draw_clouds(canvas, 3.0, 12.0, rng);
}

void paint_pavement(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 85);
  lay_pieces(canvas, area, {{0.6, 0.6}, 0.035, 115, 175, true}, rng);
  draw_octaves(canvas, area, 0.4, 0.05, 55, rng);
}

void paint_foliage(Canvas& canvas, const Area& area, Rng& rng) {
  canvas.fill_area(area, 80);
  for (double size = 0.5; size > 3.0 * canvas.texel_m(); size *= 0.6) {
    draw_polygons(canvas, area, size, 0.35, 55, rng);
  }
}

}  // namespace

Image paint(Style style, const Vector2d& size_m, double texel_m, Rng& rng) {
  using Painter = void (*)(Canvas&, const Area&, Rng&);
  constexpr std::array<Painter, 14> kPainters = {paint_wall,
                                                 paint_bare,
                                                 paint_blank,
                                                 paint_floor,
                                                 paint_tiles,
                                                 paint_ceiling,
                                                 paint_books,
                                                 paint_crate,
                                                 draw_poster,
                                                 paint_facade,
                                                 paint_road,
                                                 paint_pavement,
                                                 paint_foliage,
                                                 paint_metal};
  Canvas canvas(size_m, texel_m, 128);
  kPainters.at(static_cast<std::size_t>(style))(canvas, canvas.area(), rng);
  return std::move(canvas.image());
}

}  // namespace waymark

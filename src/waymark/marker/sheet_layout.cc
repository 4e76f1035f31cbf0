// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/sheet_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr double kSheetMarginMm = 8.0;  ///< That printers leave white.
constexpr double kRulerMm = 100.0;
constexpr double kLineMm = 0.2;
constexpr double kCaptionMm = 9.0;  ///< Below a marker.
constexpr double kFooterMm = 14.0;  ///< With the ruler.

/// How markers lie on a page.
struct Grid {
  double size_mm;
  double quiet_mm;  ///< White around each, which neighbours share.
  double first_mm;  ///< From the edges of the paper to the first one.
  int columns;
  int rows;

  double column_mm() const { return size_mm + quiet_mm; }
  double row_mm() const { return size_mm + quiet_mm + kCaptionMm; }
};

Grid grid_for(const MarkerFamily& family, double size_m, const Paper& paper) {
  Grid grid{1e3 * size_m, 1e3 * size_m / family.side_modules(), 0.0, 0, 0};
  grid.first_mm = std::max(kSheetMarginMm, grid.quiet_mm);
  const double width = paper.width_mm - 2.0 * grid.first_mm + grid.quiet_mm;
  const double height = paper.height_mm - grid.first_mm - kSheetMarginMm - kFooterMm;
  grid.columns = static_cast<int>(width / grid.column_mm());
  grid.rows = static_cast<int>(height / grid.row_mm());
  if (grid.columns > 0 && grid.rows > 0) return grid;
  const double white = 1.0 + 2.0 / family.side_modules();
  const double most_mm =
      std::min({paper.width_mm / white,
                paper.width_mm - 2.0 * kSheetMarginMm,
                (paper.height_mm - kSheetMarginMm - kFooterMm - kCaptionMm) / white});
  throw InputError(
      "--size",
      fmt::format("is {:.4g} m, expected at most {:.3f} on paper of {:.0f} x {:.0f} mm",
                  size_m,
                  std::floor(most_mm) / 1e3,
                  paper.width_mm,
                  paper.height_mm));
}

/// The black square and, on it, what is white; modules beside each other are one box.
void add_marker(const MarkerFamily& family, int id, const SheetBox& black, SheetPage& page) {
  const int count = family.side_modules();
  const double module_mm = black.width_mm / count;
  const std::vector<std::uint8_t> modules = family.modules(id);
  page.boxes.push_back(black);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < count;) {
      int end = column;
      while (end < count && modules[static_cast<std::size_t>(row * count + end)]) ++end;
      if (end > column) {
        page.boxes.push_back({black.x_mm + column * module_mm,
                              black.y_mm + row * module_mm,
                              (end - column) * module_mm,
                              module_mm,
                              true});
      }
      column = end + 1;
    }
  }
}

void add_ruler(const Paper& paper, SheetPage& page) {
  const double y_mm = paper.height_mm - kSheetMarginMm - 4.0;
  page.boxes.push_back({kSheetMarginMm, y_mm - 0.5 * kLineMm, kRulerMm, kLineMm});
  for (int tick = 0; tick <= 10; ++tick) {
    const double x_mm = kSheetMarginMm + 0.1 * tick * kRulerMm;
    page.boxes.push_back({x_mm - 0.5 * kLineMm, y_mm - 2.0, kLineMm, 2.0});
  }
  page.texts.push_back(
      {kSheetMarginMm + kRulerMm + 3.0, y_mm, "100 mm: print at 100 %, measure the black squares"});
}

SheetPage lay_out_page(const MarkerFamily& family,
                       const Grid& grid,
                       std::span<const int> ids,
                       const Paper& paper) {
  SheetPage page;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const int column = static_cast<int>(i) % grid.columns;
    const int row = static_cast<int>(i) / grid.columns;
    const double x_mm = grid.first_mm + column * grid.column_mm();
    const double y_mm = grid.first_mm + row * grid.row_mm();
    add_marker(family, ids[i], {x_mm, y_mm, grid.size_mm, grid.size_mm}, page);
    page.texts.push_back({x_mm,
                          y_mm + grid.size_mm + 0.5 * grid.quiet_mm + 3.6,
                          fmt::format("{} {}, {:.1f} mm", family.name(), ids[i], grid.size_mm)});
  }
  add_ruler(paper, page);
  return page;
}

}  // namespace

std::vector<SheetPage> lay_out_sheets(const MarkerFamily& family,
                                      double size_m,
                                      std::span<const int> ids,
                                      const Paper& paper) {
  for (const int id : ids) {
    if (id >= 0 && id < family.size()) continue;
    throw InputError(
        "--ids",
        fmt::format("{} is unknown, expected 0 to {} of {}", id, family.size() - 1, family.name()));
  }
  const Grid grid = grid_for(family, size_m, paper);
  const auto per_page = static_cast<std::size_t>(grid.columns * grid.rows);
  std::vector<SheetPage> pages;
  for (std::size_t first = 0; first < ids.size(); first += per_page) {
    const std::size_t count = std::min(per_page, ids.size() - first);
    pages.push_back(lay_out_page(family, grid, ids.subspan(first, count), paper));
  }
  return pages;
}

}  // namespace waymark

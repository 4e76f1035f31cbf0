// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr double kMarginMm = 8.0;   ///< That printers leave white.
constexpr double kCaptionMm = 9.0;  ///< Below a marker.
constexpr double kFooterMm = 14.0;  ///< With the ruler.
constexpr double kRulerMm = 100.0;

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
  grid.first_mm = std::max(kMarginMm, grid.quiet_mm);
  const double width = paper.width_mm - 2.0 * grid.first_mm + grid.quiet_mm;
  const double height = paper.height_mm - grid.first_mm - kMarginMm - kFooterMm;
  grid.columns = static_cast<int>(width / grid.column_mm());
  grid.rows = static_cast<int>(height / grid.row_mm());
  if (grid.columns > 0 && grid.rows > 0) return grid;
  const double white = 1.0 + 2.0 / family.side_modules();
  const double most_mm = std::min({paper.width_mm / white,
                                   paper.width_mm - 2.0 * kMarginMm,
                                   (paper.height_mm - kMarginMm - kFooterMm - kCaptionMm) / white});
  throw InputError(
      "--size",
      fmt::format("is {:.4g} m, expected at most {:.3f} on paper of {:.0f} x {:.0f} mm",
                  size_m,
                  std::floor(most_mm) / 1e3,
                  paper.width_mm,
                  paper.height_mm));
}

/// White modules on a black square, those beside each other in one piece.
std::string draw_marker(
    const MarkerFamily& family, int id, double x_mm, double y_mm, double size_mm) {
  const int count = family.side_modules();
  const double module_mm = size_mm / count;
  const std::vector<std::uint8_t> modules = family.modules(id);
  std::string text = fmt::format(
      "<g id=\"marker-{}\"><rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"/>"
      "<path fill=\"#fff\" d=\"",
      id,
      x_mm,
      y_mm,
      size_mm,
      size_mm);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < count;) {
      int end = column;
      while (end < count && modules[static_cast<std::size_t>(row * count + end)]) ++end;
      if (end > column) {
        text += fmt::format("M{:.4f} {:.4f}h{:.4f}v{:.4f}h{:.4f}z",
                            x_mm + column * module_mm,
                            y_mm + row * module_mm,
                            (end - column) * module_mm,
                            module_mm,
                            -(end - column) * module_mm);
      }
      column = end + 1;
    }
  }
  return text + "\"/></g>\n";
}

std::string draw_ruler(const Paper& paper) {
  const double y = paper.height_mm - kMarginMm - 4.0;
  std::string text = fmt::format(
      "<path stroke=\"#000\" stroke-width=\"0.2\" d=\"M{} {}h{}", kMarginMm, y, kRulerMm);
  for (int tick = 0; tick <= 10; ++tick) {
    text += fmt::format("M{} {}v-2", kMarginMm + 0.1 * tick * kRulerMm, y);
  }
  return text + fmt::format(
                    "\"/>\n<text x=\"{}\" y=\"{}\" font-size=\"3.2\">100 mm: print at 100 "
                    "%, measure the black squares</text>\n",
                    kMarginMm + kRulerMm + 3.0,
                    y);
}

std::string draw_page(const MarkerFamily& family,
                      const Grid& grid,
                      std::span<const int> ids,
                      const Paper& paper) {
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" shape-rendering=\"crispEdges\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      paper.width_mm,
      paper.height_mm);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const int column = static_cast<int>(i) % grid.columns;
    const int row = static_cast<int>(i) / grid.columns;
    const double x = grid.first_mm + column * grid.column_mm();
    const double y = grid.first_mm + row * grid.row_mm();
    text += draw_marker(family, ids[i], x, y, grid.size_mm);
    text += fmt::format(
        "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"3.2\">{} {} &#183; {:.1f} mm"
        "</text>\n",
        x,
        y + grid.size_mm + 0.5 * grid.quiet_mm + 3.6,
        family.name(),
        ids[i],
        grid.size_mm);
  }
  return text + draw_ruler(paper) + "</svg>\n";
}

}  // namespace

std::vector<std::string> marker_sheets(const MarkerFamily& family,
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
  std::vector<std::string> pages;
  for (std::size_t first = 0; first < ids.size(); first += per_page) {
    const std::size_t count = std::min(per_page, ids.size() - first);
    pages.push_back(draw_page(family, grid, ids.subspan(first, count), paper));
  }
  return pages;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "waymark/marker/sheet_layout.h"

namespace waymark {
namespace {

std::string draw_marker(const SheetMarker& marker) {
  std::string text = fmt::format(
      "<g id=\"marker-{}\"><rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"/>"
      "<path fill=\"#fff\" d=\"",
      marker.id,
      marker.black.x_mm,
      marker.black.y_mm,
      marker.black.width_mm,
      marker.black.height_mm);
  for (const SheetBox& box : marker.white) {
    text += fmt::format("M{:.4f} {:.4f}h{:.4f}v{:.4f}h{:.4f}z",
                        box.x_mm,
                        box.y_mm,
                        box.width_mm,
                        box.height_mm,
                        -box.width_mm);
  }
  return text +
         fmt::format("\"/></g>\n<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{}\">{}</text>\n",
                     marker.black.x_mm,
                     marker.caption_y_mm,
                     kSheetTextMm,
                     marker.caption);
}

std::string draw_ruler(const Paper& paper) {
  const double y = ruler_y_mm(paper);
  std::string text = fmt::format(
      "<path stroke=\"#000\" stroke-width=\"0.2\" d=\"M{} {}h{}", kSheetMarginMm, y, kSheetRulerMm);
  for (int tick = 0; tick <= 10; ++tick) {
    text += fmt::format("M{} {}v-2", kSheetMarginMm + 0.1 * tick * kSheetRulerMm, y);
  }
  return text + fmt::format("\"/>\n<text x=\"{}\" y=\"{}\" font-size=\"{}\">{}</text>\n",
                            kSheetMarginMm + kSheetRulerMm + 3.0,
                            y,
                            kSheetTextMm,
                            kSheetRulerText);
}

}  // namespace

std::vector<std::string> marker_sheets(const MarkerFamily& family,
                                       double size_m,
                                       std::span<const int> ids,
                                       const Paper& paper) {
  std::vector<std::string> pages;
  for (const SheetPage& page : lay_out_sheets(family, size_m, ids, paper)) {
    std::string text = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
        "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" shape-rendering=\"crispEdges\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
        paper.width_mm,
        paper.height_mm);
    for (const SheetMarker& marker : page) text += draw_marker(marker);
    pages.push_back(text + draw_ruler(paper) + "</svg>\n");
  }
  return pages;
}

}  // namespace waymark

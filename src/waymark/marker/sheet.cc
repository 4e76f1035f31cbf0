// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "waymark/marker/sheet_layout.h"

namespace waymark {

std::vector<std::string> marker_sheets(const MarkerFamily& family,
                                       double size_m,
                                       std::span<const int> ids,
                                       const Paper& paper) {
  std::vector<std::string> pages;
  for (const SheetPage& page : lay_out_sheets(family, size_m, ids, paper)) {
    std::string text = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
        "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"{2}\" "
        "shape-rendering=\"crispEdges\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
        paper.width_mm,
        paper.height_mm,
        kSheetTextMm);
    for (const SheetBox& box : page.boxes) {
      text +=
          fmt::format("<rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"{}/>\n",
                      box.x_mm,
                      box.y_mm,
                      box.width_mm,
                      box.height_mm,
                      box.is_white ? " fill=\"#fff\"" : "");
    }
    for (const SheetText& words : page.texts) {
      text += fmt::format(
          "<text x=\"{:.2f}\" y=\"{:.2f}\">{}</text>\n", words.x_mm, words.y_mm, words.words);
    }
    pages.push_back(text + "</svg>\n");
  }
  return pages;
}

}  // namespace waymark

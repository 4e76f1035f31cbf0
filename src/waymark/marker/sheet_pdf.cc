// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstddef>

#include "waymark/marker/sheet_layout.h"

namespace waymark {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;

/// Millimetres from the top left are made points from the bottom left by the first line.
std::string draw_page(const SheetPage& page, const Paper& paper) {
  std::string content = fmt::format("{0:.8f} 0 0 {0:.8f} 0 0 cm\n", kPointsPerMm);
  for (const SheetBox& box : page.boxes) {
    content += fmt::format("{} g {:.4f} {:.4f} {:.4f} {:.4f} re f\n",
                           box.is_white ? 1 : 0,
                           box.x_mm,
                           paper.height_mm - box.y_mm - box.height_mm,
                           box.width_mm,
                           box.height_mm);
  }
  for (const SheetText& text : page.texts) {
    content += fmt::format("0 g BT /F1 {} Tf {:.3f} {:.3f} Td ({}) Tj ET\n",
                           kSheetTextMm,
                           text.x_mm,
                           paper.height_mm - text.y_mm,
                           text.words);
  }
  return content;
}

}  // namespace

std::string marker_sheets_pdf(const MarkerFamily& family,
                              double size_m,
                              std::span<const int> ids,
                              const Paper& paper) {
  const std::vector<SheetPage> pages = lay_out_sheets(family, size_m, ids, paper);
  std::string kids;
  for (std::size_t i = 0; i < pages.size(); ++i) kids += fmt::format("{} 0 R ", 4 + 2 * i);
  std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R >>",
      fmt::format("<< /Type /Pages /Count {} /Kids [{}] >>", pages.size(), kids),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>"};
  for (const SheetPage& page : pages) {
    objects.push_back(
        fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents {} 0 R "
                    "/Resources << /Font << /F1 3 0 R >> >> >>",
                    paper.width_mm * kPointsPerMm,
                    paper.height_mm * kPointsPerMm,
                    objects.size() + 2));
    const std::string content = draw_page(page, paper);
    objects.push_back(
        fmt::format("<< /Length {} >>\nstream\n{}endstream", content.size(), content));
  }
  // Numbered objects, then the table of where each begins (ISO 32000-1, 7.5).
  std::string file = "%PDF-1.4\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  return file + fmt::format("{}trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n",
                            table,
                            objects.size() + 1,
                            file.size());
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstddef>

#include "waymark/marker/sheet_layout.h"

namespace waymark {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;

/// A file of numbered objects with the table of where each begins (ISO 32000-1, 7.5).
class PdfFile {
 public:
  /// The next object; its number counts from 1.
  void add(const std::string& content) {
    starts_.push_back(text_.size());
    text_ += fmt::format("{} 0 obj\n{}\nendobj\n", starts_.size(), content);
  }

  /// root: number of the catalogue.
  std::string finish(std::size_t root) {
    const std::size_t table = text_.size();
    text_ += fmt::format("xref\n0 {}\n0000000000 65535 f \n", starts_.size() + 1);
    for (const std::size_t start : starts_) text_ += fmt::format("{:010} 00000 n \n", start);
    return text_ + fmt::format("trailer\n<< /Size {} /Root {} 0 R >>\nstartxref\n{}\n%%EOF\n",
                               starts_.size() + 1,
                               root,
                               table);
  }

 private:
  std::string text_ = "%PDF-1.4\n";
  std::vector<std::size_t> starts_;
};

/// Millimetres from the top left are made points from the bottom left by the first line.
std::string draw_page(const SheetPage& page, const Paper& paper) {
  const auto y_of = [&](double y_mm) { return paper.height_mm - y_mm; };
  const auto box = [&](const SheetBox& of) {
    return fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re\n",
                       of.x_mm,
                       y_of(of.y_mm + of.height_mm),
                       of.width_mm,
                       of.height_mm);
  };
  const auto text = [&](double x_mm, double y_mm, const std::string& words) {
    return fmt::format(
        "BT /F1 {} Tf {:.3f} {:.3f} Td ({}) Tj ET\n", kSheetTextMm, x_mm, y_of(y_mm), words);
  };
  std::string content = fmt::format("{0:.8f} 0 0 {0:.8f} 0 0 cm\n", kPointsPerMm);
  for (const SheetMarker& marker : page) {
    content += "0 g\n" + box(marker.black) + "f\n1 g\n";
    for (const SheetBox& white : marker.white) content += box(white);
    content += "f\n0 g\n" + text(marker.black.x_mm, marker.caption_y_mm, marker.caption);
  }
  const double ruler = ruler_y_mm(paper);
  content += fmt::format("0.2 w\n{} {} m {} {} l\n",
                         kSheetMarginMm,
                         y_of(ruler),
                         kSheetMarginMm + kSheetRulerMm,
                         y_of(ruler));
  for (int tick = 0; tick <= 10; ++tick) {
    const double x = kSheetMarginMm + 0.1 * tick * kSheetRulerMm;
    content += fmt::format("{0} {1} m {0} {2} l\n", x, y_of(ruler), y_of(ruler) + 2.0);
  }
  return content + "S\n" + text(kSheetMarginMm + kSheetRulerMm + 3.0, ruler, kSheetRulerText);
}

}  // namespace

std::string marker_sheets_pdf(const MarkerFamily& family,
                              double size_m,
                              std::span<const int> ids,
                              const Paper& paper) {
  const std::vector<SheetPage> pages = lay_out_sheets(family, size_m, ids, paper);
  PdfFile file;
  file.add("<< /Type /Catalog /Pages 2 0 R >>");
  std::string kids;
  for (std::size_t i = 0; i < pages.size(); ++i) kids += fmt::format("{} 0 R ", 4 + 2 * i);
  file.add(fmt::format("<< /Type /Pages /Count {} /Kids [{}] >>", pages.size(), kids));
  file.add("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>");
  for (std::size_t i = 0; i < pages.size(); ++i) {
    file.add(
        fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents {} 0 R "
                    "/Resources << /Font << /F1 3 0 R >> >> >>",
                    paper.width_mm * kPointsPerMm,
                    paper.height_mm * kPointsPerMm,
                    5 + 2 * i));
    const std::string content = draw_page(pages[i], paper);
    file.add(fmt::format("<< /Length {} >>\nstream\n{}endstream", content.size(), content));
  }
  return file.finish(1);
}

}  // namespace waymark

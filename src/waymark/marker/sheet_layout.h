// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "waymark/marker/family.h"
#include "waymark/marker/sheet.h"

namespace waymark {

/// Where things lie on a sheet, in millimetres from its top left; the same in every format.
inline constexpr double kSheetMarginMm = 8.0;   ///< That printers leave white.
inline constexpr double kSheetRulerMm = 100.0;  ///< Its length.
inline constexpr double kSheetTextMm = 3.2;     ///< Height of letters.
inline constexpr const char* kSheetRulerText = "100 mm: print at 100 %, measure the black squares";

/// A rectangle on a sheet.
struct SheetBox {
  double x_mm;
  double y_mm;
  double width_mm;
  double height_mm;
};

/// A marker on a page.
struct SheetMarker {
  int id;
  SheetBox black;               ///< The whole square.
  std::vector<SheetBox> white;  ///< On it; modules beside each other are one.
  std::string caption;          ///< Family, number and size.
  double caption_y_mm;          ///< Of its base line; it begins below the left side.
};

/// What lies on a page.
using SheetPage = std::vector<SheetMarker>;

/// As many markers to a page as fit with the white around them that detection needs. Throws
/// InputError where an id is unknown or not even one fits.
std::vector<SheetPage> lay_out_sheets(const MarkerFamily& family,
                                      double size_m,
                                      std::span<const int> ids,
                                      const Paper& paper);

/// Base line of the ruler.
inline double ruler_y_mm(const Paper& paper) { return paper.height_mm - kSheetMarginMm - 4.0; }

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "waymark/marker/family.h"
#include "waymark/marker/sheet.h"

namespace waymark {

inline constexpr double kSheetTextMm = 3.2;  ///< Height of letters.

/// A rectangle on a sheet, in millimetres from its top left.
struct SheetBox {
  double x_mm;
  double y_mm;
  double width_mm;
  double height_mm;
  bool is_white = false;  ///< Else black.
};

/// Words on a sheet: where their base line begins, in millimetres from its top left.
struct SheetText {
  double x_mm;
  double y_mm;
  std::string words;
};

/// What lies on a page, the same in every format; boxes cover those before them.
struct SheetPage {
  std::vector<SheetBox> boxes;
  std::vector<SheetText> texts;
};

/// As many markers to a page as fit with the white around them that detection needs, with captions
/// and a ruler. Throws InputError where an id is unknown or not even one fits.
std::vector<SheetPage> lay_out_sheets(const MarkerFamily& family,
                                      double size_m,
                                      std::span<const int> ids,
                                      const Paper& paper);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "waymark/marker/family.h"

namespace waymark {

/// A sheet of paper, upright.
struct Paper {
  double width_mm = 210.0;   ///< A4.
  double height_mm = 297.0;  ///< A4.
};

/// Pages of markers as SVG, in millimetres, to be printed at 100 %: each with its number, its size
/// and a ruler of 100 mm to check the print by, as many to a page as fit with the white around them
/// that detection needs. Throws InputError where an id is unknown or not even one fits.
std::vector<std::string> marker_sheets(const MarkerFamily& family,
                                       double size_m,
                                       std::span<const int> ids,
                                       const Paper& paper = {});

/// The same pages as one PDF file.
std::string marker_sheets_pdf(const MarkerFamily& family,
                              double size_m,
                              std::span<const int> ids,
                              const Paper& paper = {});

}  // namespace waymark

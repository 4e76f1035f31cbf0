// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "waymark/camera/camera.h"

namespace waymark {

/// How far around where it is predicted a landmark is looked for: at least a number of pixels, and
/// in images of more than a megapixel a part of their side (of a square as large), so that it
/// follows the resolution. See docs/decisions/track.md.
inline double search_radius_px(const Camera& camera, double least_px, double part_of_side) {
  const double side_px = std::sqrt(static_cast<double>(camera.width_px()) * camera.height_px());
  return std::max(least_px, part_of_side * side_px);
}

}  // namespace waymark

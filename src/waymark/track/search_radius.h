// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "waymark/camera/camera.h"

namespace waymark {

/// Around where it is predicted a landmark is looked for within a part of the image, so that the
/// radius follows the resolution: a part of the side in pixels of a square as large as the image.
inline double search_radius_px(const Camera& camera, double part_of_side) {
  return part_of_side * std::sqrt(static_cast<double>(camera.width_px()) * camera.height_px());
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/image/corner.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// Radius of the disc whose intensity centroid gives the orientation.
inline constexpr int kOrientationRadius = 15;

/// Angle in rad from the centre of each corner to the intensity centroid of the disc around it
/// (Rublee et al. 2011, section 3.2), -pi..pi, clockwise as y points down; 0 for a uniform disc.
/// Corners must be at least kOrientationRadius from the border.
void orient(const PaddedImage& image, std::span<const Corner> corners, std::span<float> angles_rad);

}  // namespace waymark

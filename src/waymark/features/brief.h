// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/features/corner.h"
#include "waymark/features/features.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// Reused by gaussian_blur.
struct BlurWorkspace {
  void reserve(int width_px);

  std::vector<std::uint16_t> row;  ///< Blurred along columns, 8 fractional bits.
};

/// 7x7 Gaussian of sigma 2, mirrored at the borders (without repeating the outermost pixel), as
/// rotated BRIEF wants it. Rounds in such a way that it differs from the exact value by less than
/// 0.52. The image must be at least 4 pixels wide and high.
void gaussian_blur(const PaddedImage& source, BlurWorkspace& workspace, PaddedImage& result);

/// Radius of the disc whose intensity centroid gives the orientation.
inline constexpr int kOrientationRadius = 15;

/// Angle in rad from the centre of each corner to the intensity centroid of the disc around it
/// (Rublee et al. 2011, section 3.2), -pi..pi, clockwise as y points down; 0 for a uniform disc.
/// Corners must be at least kOrientationRadius from the border.
void orient(const PaddedImage& image, std::span<const Corner> corners, std::span<float> angles_rad);

/// How far the rotated pattern reaches: its corners are 13 sqrt(2) from the centre.
inline constexpr int kBriefRadius = 19;

/// Rotated BRIEF (Rublee et al. 2011, section 4.1) with the published sampling pattern. Bit k of a
/// descriptor is set if the first pixel of test k is darker than the second, in an image that
/// gaussian_blur has smoothed; the pattern is turned by the angle and rounded to whole pixels.
/// Corners must be at least kBriefRadius from the border; arrays have one entry for each corner.
void describe(const PaddedImage& smooth,
              std::span<const Corner> corners,
              std::span<const float> angles_rad,
              std::span<Descriptor> descriptors);

}  // namespace waymark

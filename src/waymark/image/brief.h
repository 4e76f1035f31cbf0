// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/image/corner.h"
#include "waymark/image/features.h"
#include "waymark/image/padded_image.h"

namespace waymark {

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

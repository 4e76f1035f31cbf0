// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/image/image.h"

namespace waymark {

/// Distance in pixels from each pixel to the nearest one that is 0, row by row; infinite where
/// there is none (Felzenszwalb and Huttenlocher 2012, Distance transforms of sampled functions).
std::vector<float> distances_to_zero(ImageView image);

}  // namespace waymark

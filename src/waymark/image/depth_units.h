// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/image/depth.h"
#include "waymark/image/image.h"

namespace waymark {

/// Depth in metres in the units of the settings, rounded. 0, no measurement, where it is not
/// positive and finite or more than the units can say (65535 of them).
DepthImage depth_in_units(const BasicImageView<float>& depth_m, const DepthSettings& settings);

}  // namespace waymark

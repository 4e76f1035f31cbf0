// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/depth_units.h"

#include <limits>

namespace waymark {

DepthImage depth_in_units(const BasicImageView<float>& depth_m, const DepthSettings& settings) {
  constexpr double kEnd = std::numeric_limits<std::uint16_t>::max() + 0.5;
  DepthImage result(depth_m.width_px, depth_m.height_px);
  for (int y = 0; y < depth_m.height_px; ++y) {
    const float* from = depth_m.row(y);
    std::uint16_t* to = result.row(y);
    for (int x = 0; x < depth_m.width_px; ++x) {
      const double units = settings.factor * static_cast<double>(from[x]);
      // False for what is not a number.
      to[x] = units > 0.0 && units < kEnd ? static_cast<std::uint16_t>(units + 0.5) : 0;
    }
  }
  return result;
}

}  // namespace waymark

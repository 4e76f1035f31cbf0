// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/subpixel.h"

#include <algorithm>

namespace waymark {
namespace {

float peak_of_parabola(int before, int middle, int after) {
  const int curvature = before - 2 * middle + after;
  if (curvature >= 0) return 0.0f;
  const float peak = static_cast<float>(before - after) / static_cast<float>(2 * curvature);
  return std::clamp(peak, -0.5f, 0.5f);
}

}  // namespace

SubpixelOffset locate_peak(const PaddedImage& scores, const Corner& corner) {
  const std::uint8_t* const at = scores.row(corner.y_px) + corner.x_px;
  return {peak_of_parabola(at[-1], at[0], at[1]),
          peak_of_parabola(at[-scores.stride()], at[0], at[scores.stride()])};
}

}  // namespace waymark

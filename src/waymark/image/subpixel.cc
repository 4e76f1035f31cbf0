// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/subpixel.h"

#include <algorithm>

namespace waymark {

SubpixelOffset locate_peak(const ScorePatch& s) {
  const int left = s[0] + s[3] + s[6];
  const int middle = s[1] + s[4] + s[7];
  const int right = s[2] + s[5] + s[8];
  const int top = s[0] + s[1] + s[2];
  const int centre = s[3] + s[4] + s[5];
  const int bottom = s[6] + s[7] + s[8];
  // The normal equations of a regular grid fall apart into sums; all times 12.
  const auto gradient_x = static_cast<float>(2 * (right - left));
  const auto gradient_y = static_cast<float>(2 * (bottom - top));
  const auto curvature_xx = static_cast<float>(4 * (left - 2 * middle + right));
  const auto curvature_yy = static_cast<float>(4 * (top - 2 * centre + bottom));
  const auto curvature_xy = static_cast<float>(3 * (s[0] + s[8] - s[2] - s[6]));
  const float determinant = curvature_xx * curvature_yy - curvature_xy * curvature_xy;
  if (!(determinant > 0.0f) || curvature_xx >= 0.0f) return {};
  const float x = (curvature_xy * gradient_y - curvature_yy * gradient_x) / determinant;
  const float y = (curvature_xy * gradient_x - curvature_xx * gradient_y) / determinant;
  return {std::clamp(x, -0.5f, 0.5f), std::clamp(y, -0.5f, 0.5f)};
}

}  // namespace waymark

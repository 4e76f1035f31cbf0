// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/map/map.h"

namespace waymark {

/// What the residuals of a map say of the focal length that it was made with.
struct FocalCheck {
  double factor = 1.0;  ///< The true focal length relative to the calibration's.
  double sigma = 0.0;   ///< Standard deviation of the factor.

  /// Whether the calibration is off by more than 2 %, beyond doubt.
  bool is_off() const;
};

/// Adjusts the newest keyframe and those that share most with it for several focal lengths around
/// that of the calibration, structure and motion anew each time, and finds the one that leaves the
/// least cost, by parabolas through three. Nothing where the map is too small, where the motion
/// does not tell focal lengths apart, and for cameras that have none (360 degrees).
std::optional<FocalCheck> check_focal_length(const Map& map);

}  // namespace waymark

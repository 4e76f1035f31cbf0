// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "waymark/map/map.h"

namespace waymark {

/// What the residuals of a map say of the calibration that it was made with.
struct FocalCheck {
  double factor = 1.0;     ///< The true focal length relative to the calibration's.
  double sigma = 0.0;      ///< Standard deviation of the factor.
  bool is_beyond = false;  ///< The search ended at the factor, on the way to one further off.
  /// So much of its distance from the principal point the corner of the image should lie further
  /// out than in the image, for the distortion that is stated: 0 where that fits.
  double bend = 0.0;
  double bend_sigma = 0.0;  ///< Standard deviation of the bend; 0 where no least cost was in sight.

  /// Whether the focal length is off by more than 2 %, beyond doubt.
  bool is_off() const;
  /// Whether the focal length may be right but the distortion is not, beyond doubt.
  bool is_bent() const;
};

/// Adjusts the newest keyframe and those that share most with it for several focal lengths around
/// that of the calibration, structure and motion anew each time, and finds the one that leaves the
/// least cost, by parabolas through three; the same for images bent around the principal point.
/// Nothing where the map is too small, where the motion does not tell focal lengths apart, and for
/// cameras that have none (360 degrees).
std::optional<FocalCheck> check_focal_length(const Map& map);

/// Frames until the check of the focal length: with half as many, cars that drive on are told of
/// errors of 2 to 3 % that their calibrations do not have (KITTI 00 and 07).
inline constexpr std::uint32_t kFramesToCheck = 200;

/// Whether a map comes late enough for the check of the focal length.
bool has_focal_check(const Map& map, FrameId first);

}  // namespace waymark

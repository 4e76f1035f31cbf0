// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/map/map.h"

namespace waymark {

/// Whether the picture moves within its frame from image to image, as stabilised video does.
struct PictureMotion {
  /// By so much: the standard deviation of the place of the principal point, along the axis where
  /// it is larger.
  double scatter_px = 0.0;
  /// The part of the residuals' cost that goes where each image may be shifted.
  double explained = 0.0;
  int width_px = 0;  ///< Of the images.

  /// Whether that is more than any camera that is not stabilised does.
  bool is_stabilised() const;
};

/// Adjusts the newest keyframes of a map, poses and landmarks, with and without a shift of each
/// image of its own, by as many steps from where they are, and compares. A wrong calibration is
/// wrong in all images alike, and both adjust focal length and distortion; a shift is told from a
/// turn by what is far from the middle of the image, and from a rolling shutter, which shears and
/// stretches. Nothing where the map is too small, and for cameras whose columns wrap (360 degrees),
/// of which a shift is a turn.
std::optional<PictureMotion> find_picture_motion(const Map& map);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/camera/camera.h"

namespace waymark {

/// A marker as one image shows it. Corners run clockwise as one looks at the marker: top left, top
/// right, bottom right, bottom left of its upright print.
struct MarkerObservation {
  int id = 0;                               ///< Its number within the family.
  std::uint8_t camera = 0;                  ///< Index in the rig.
  std::array<Eigen::Vector2f, 4> pixels;    ///< Of the corners, sub-pixel.
  std::array<Eigen::Vector3f, 4> bearings;  ///< Of the corners, unit, in the camera.
  /// Derivatives of the pixels by the bearings, there (W of Features at level 0).
  std::array<Matrix23f, 4> pixel_from_bearing;
};

/// All markers of a frame, by id, then as found.
using MarkerObservations = std::vector<MarkerObservation>;

/// A corner in the frame of a marker: its middle is the origin, x points to the right of the print,
/// y up, z out of it to who looks at it. side: of the black square, in any unit.
inline Eigen::Vector3d marker_corner(std::size_t corner, double side) {
  const double half = 0.5 * side;
  const bool is_right = corner == 1 || corner == 2;
  return {is_right ? half : -half, corner < 2 ? half : -half, 0.0};
}

}  // namespace waymark

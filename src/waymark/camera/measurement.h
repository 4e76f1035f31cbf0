// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "waymark/camera/camera.h"

namespace waymark {

/// What one feature measures of the point that it shows.
struct Measurement {
  std::uint8_t camera = 0;                             ///< Index in the rig.
  Eigen::Vector3f bearing = Eigen::Vector3f::UnitZ();  ///< Unit, in the camera.
  /// Derivative of the pixel of the feature's level by the bearing, there (W of Features).
  Matrix23f level_pixel_from_bearing = Matrix23f::Zero();
  float inverse_range = 0.0f;        ///< 1/m, measured; see inverse_range_sigma.
  float inverse_range_sigma = 0.0f;  ///< 1/m; 0 where there is no measurement.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "waymark/camera/rig.h"

namespace waymark {

/// What rectification leaves: the images of the second camera of a pair are bent smoothly against
/// what its calibration says, along and across the epipolar lines. No calibration file can say so.
class RectificationError {
 public:
  /// None.
  RectificationError() = default;
  /// Of camera 1 of a rig, random by the seed. largest_px: along and across the lines, at the worst
  /// place of the image, in pixels of its middle.
  RectificationError(const RigCamera& camera1,
                     const Eigen::Vector2d& largest_px,
                     std::uint64_t seed);

  /// The direction that is seen where the calibration says this one; both unit, in the camera.
  Eigen::Vector3d true_bearing(const Eigen::Vector3d& told) const;

  /// By how much what is seen is off, in rad; see BearingError.
  const BearingError& bearing_error() const { return error_; }

 private:
  BearingError error_;
  Eigen::Vector3d baseline_ = Eigen::Vector3d::Zero();  ///< Towards camera 0, in the camera.
};

}  // namespace waymark

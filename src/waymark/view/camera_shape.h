// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "waymark/camera/rig.h"

namespace waymark {

/// How a camera is drawn: a pyramid through the corners of its image, or a sphere.
struct CameraShape {
  bool is_sphere = false;
  std::uint32_t rig = 0;
  Eigen::Vector3d position_in_rig = Eigen::Vector3d::Zero();
  /// Unit; top left, top right, bottom right, bottom left. 0 for a sphere.
  std::array<Eigen::Vector3d, 4> corners_in_rig{Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero()};
};

/// The shape of a camera of any model. Where the corners of the image show nothing (fisheye), the
/// outermost pixels towards them that do stand for them. The rig is left to the caller.
CameraShape shape_of(const RigCamera& camera);

}  // namespace waymark

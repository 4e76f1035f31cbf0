// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

/// What one frame measures of known points, as parallel arrays that the caller owns and reuses.
/// inverse_range and inverse_range_sigma may be empty: no ranges.
struct PoseObservations {
  std::vector<Eigen::Vector3d> point_in_world;
  std::vector<Eigen::Vector3f> bearing;             ///< Measured, unit, in the observing camera.
  std::vector<Matrix23f> level_pixel_from_bearing;  ///< W of Features.
  std::vector<std::uint8_t> camera;                 ///< Index in the rig.
  std::vector<float> inverse_range;                 ///< 1/m, measured; see inverse_range_sigma.
  std::vector<float> inverse_range_sigma;           ///< 1/m; 0 where there is no measurement.

  std::size_t size() const { return point_in_world.size(); }
  void clear();
  /// Adds what was measured of a point.
  void add(const Eigen::Vector3d& point, const Measurement& measured);
};

/// Memory of optimize_pose, kept between calls so that they do not allocate.
class PoseWorkspace {
 public:
  struct Arrays;  ///< Defined beside the kernel.

  PoseWorkspace();
  ~PoseWorkspace();
  PoseWorkspace(PoseWorkspace&&) noexcept;
  PoseWorkspace& operator=(PoseWorkspace&&) noexcept;

  Arrays& arrays() { return *arrays_; }

 private:
  std::unique_ptr<Arrays> arrays_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/rig.h"
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

/// is_inlier lives in the workspace, until the next call with it.
struct PoseEstimate {
  Rigid3 rig_from_world;
  std::span<const std::uint8_t> is_inlier;  ///< Per observation, in the order given.
  std::size_t num_inliers = 0;
  /// Of the left perturbation xi in exp(xi) * rig_from_world, with xi = (translation, rotation).
  /// Scaled by the noise that the inliers show, the part of the ranges by theirs; large but
  /// finite where the observations say nothing.
  Matrix6d covariance = Matrix6d::Zero();
  int num_iterations = 0;
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

/// Pose of a rig from points with known positions, from a prediction that may be several pixels
/// off and with up to about half of the observations wrong. Minimises
/// |W * (normalize(cam_from_rig * rig_from_world * point) - bearing)|^2, plus, where there is a
/// range, ((1 / |point_in_cam| - inverse_range) / inverse_range_sigma)^2. A component of a residual
/// is assumed to have a standard deviation of 1 px of the feature's level; what passes a gate of
/// 95 % is an inlier.
/// The range never decides whether an observation is an inlier; a wrong range is discounted alone.
/// Levenberg-Marquardt with a Geman-McClure loss whose scale shrinks (graduated non-convexity,
/// Yang et al. 2020), then least squares with Huber's loss on what passes the gate. Points more
/// than 90 degrees from their bearing, observations of unknown cameras and values that are not
/// finite are outliers. With too few observations the prediction comes back. Repeatable by bits.
PoseEstimate optimize_pose(const Rig& rig,
                           const PoseObservations& observations,
                           const Rigid3& initial_rig_from_world,
                           PoseWorkspace& workspace);

}  // namespace waymark

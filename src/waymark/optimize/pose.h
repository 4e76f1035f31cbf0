// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/pose_observations.h"

namespace waymark {

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

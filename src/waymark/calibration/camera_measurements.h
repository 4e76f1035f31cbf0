// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/rig.h"
#include "waymark/map/map.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// What one of the rig's cameras measured in a bundle problem, in parallel arrays: what stays as it
/// is when the camera is calibrated otherwise.
struct CameraMeasurements {
  std::vector<std::size_t> indices;     ///< Of the observations.
  std::vector<Eigen::Vector2d> pixels;  ///< Of level 0.
  std::vector<float> level_scales;      ///< Size of a pixel of the feature's level.
  /// What of a residual counts: all of it, or of points on edges what is across.
  std::vector<Eigen::Matrix2d> projectors;
  double readout_s = 0.0;  ///< That the pixels are corrected for.
  /// By what bearings differ from those of the frame's time, per millisecond of readout.
  std::vector<Eigen::Vector3f> bearing_by_readout_ms;
};

/// Per camera of the rig. observed: of each observation of the problem, in the map.
std::vector<CameraMeasurements> collect(const Map& map,
                                        std::span<const Observation> observed,
                                        const Rig& rig,
                                        const BundleProblem& problem);

/// Unit directions in which a camera should see the points of its observations.
std::vector<Eigen::Vector3d> predict(const CameraMeasurements& measured,
                                     const Rigid3& cam_from_rig,
                                     const BundleProblem& problem);

/// Makes the residuals of a camera's observations those of pixels, linear around where the points
/// should be seen. Around where they are seen, as elsewhere, noise would turn up in the
/// derivatives, and the little that tells a focal length would drown in it: the bearing becomes the
/// one that is as far from the prediction, in the plane that touches the sphere there, as the
/// pixels are. What cannot be told so counts as an outlier. directions: of predict().
void linearize(const CameraMeasurements& measured,
               const RigCamera& camera,
               const std::vector<Eigen::Vector3d>& directions,
               BundleProblem& problem);

/// Poses of a problem that were measured with one rig are with another from now on.
void use_rig(const Rig& before, const Rig& rig, BundleProblem& problem);

/// The observations of a problem, `observed` in the map, as a rig calibrated otherwise makes them.
/// Ranges that the problem leaves out stay left out.
void recompute(const Map& map,
               std::span<const Observation> observed,
               const Rig& before,
               const std::shared_ptr<const Rig>& rig,
               BundleProblem& problem);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/geometry/ransac.h"
#include "waymark/optimize/pose.h"

namespace waymark {

/// Pose of a rig from points with known positions without a prediction, most of which may be wrong:
/// RANSAC on three bearings of the camera with most observations (the first of such), then
/// optimize_pose() on all of them. A bearing's standard deviation is the angle of a pixel of its
/// level. Nothing if no pose has more support than a sample; otherwise it is for the caller
/// to say how many inliers are enough. Like optimize_pose(), is_inlier lives in the workspace.
std::optional<PoseEstimate> locate(const Rig& rig,
                                   const PoseObservations& observations,
                                   const RansacOptions& ransac_options,
                                   PoseWorkspace& workspace);

}  // namespace waymark

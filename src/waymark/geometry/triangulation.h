// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// The point in frame a that two unit bearings see: the inverse depth weighted midpoint of Lee &
/// Civera 2019 (Triangulation: Why Optimize?), which has the accuracy of the optimum at the cost of
/// three cross products and is unbiased at low parallax, where the plain midpoint comes too close.
/// Nothing if the rays are within min_parallax_rad of parallel (either way round: a point on the
/// baseline is as undetermined as one at infinity), or if the point lies behind a bearing, which
/// means against the bearing's direction; z plays no part, since a camera may see all round.
std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& bearing_a,
                                           const Eigen::Vector3d& bearing_b,
                                           const Rigid3& a_from_b,
                                           double min_parallax_rad);

/// Angle in radians at which two views see a point: between the rays from both centres.
double parallax_angle(const Eigen::Vector3d& bearing_a,
                      const Eigen::Vector3d& bearing_b,
                      const Rigid3& a_from_b);

}  // namespace waymark

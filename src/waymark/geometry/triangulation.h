// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

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

/// One sighting of a point. The residual is pixel_from_bearing * (predicted - measured bearing), a
/// 2-vector in pixels of the feature's pyramid level, in the tangent plane of the measured bearing.
struct PointSighting {
  Rigid3 cam_from_world;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  ///< Unit, in the camera's frame.
  Eigen::Matrix<double, 2, 3> pixel_from_bearing = Eigen::Matrix<double, 2, 3>::Zero();
};

/// The point nearest to all rays: least squares of the distances to them, each in proportion to the
/// point's distance, so in effect of the angles. Nothing for fewer than two sightings, if no two
/// rays differ by min_parallax_rad, or if the point lies behind one of the bearings.
std::optional<Eigen::Vector3d> triangulate(std::span<const PointSighting> sightings,
                                           double min_parallax_rad);

struct PointEstimate {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();
  /// Of point_in_world in m^2 when each residual has a standard deviation of one pixel of its
  /// level.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double squared_error_px2 = 0.0;  ///< Sum over all sightings.
};

/// Residual of a sighting in pixels and its derivative by point_in_world (2x3).
struct PointResidual {
  Eigen::Vector2d value_px;
  Eigen::Matrix<double, 2, 3> jacobian;
};
PointResidual point_residual(const PointSighting& sighting, const Eigen::Vector3d& point_in_world);

/// Refines a point by Levenberg-Marquardt on the residuals of all sightings. Nothing if the result
/// is not determined (a singular information matrix) or lies behind one of the bearings.
std::optional<PointEstimate> refine_point(std::span<const PointSighting> sightings,
                                          const Eigen::Vector3d& initial_point_in_world);

}  // namespace waymark

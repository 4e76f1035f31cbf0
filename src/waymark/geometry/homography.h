// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

/// The homography between bearings, b ~ H a with a positive factor, that maps four bearings
/// exactly; scaled to unit Frobenius norm. A plane n . x = d in front of both views induces
/// H = R + t n^T / d; the factor is then the ratio of distances, so no side of the camera is
/// special. Nothing if three bearings of a view lie on a great circle or no H has four positive
/// factors (the points cannot all lie on one plane in front).
std::optional<Eigen::Matrix3d> solve_four_point(std::span<const Eigen::Vector3d, 4> bearings_a,
                                                std::span<const Eigen::Vector3d, 4> bearings_b);

/// Squared Sampson distance of a match from b ~ H a in units of its standard deviations:
/// chi-squared of 2 degrees of freedom for a true match; infinite where H maps a to the side
/// opposite b.
double squared_homography_error(const Eigen::Matrix3d& homography,
                                const BearingMatches& matches,
                                std::size_t index);

/// Refines H (unit norm) on the matches of these indices by Gauss-Newton on the transfer error in
/// the tangent planes of b, under the loss of Geman & McClure with a scale of three standard
/// deviations. Nothing if the matches do not determine it.
std::optional<Eigen::Matrix3d> refine_homography(const Eigen::Matrix3d& homography,
                                                 const BearingMatches& matches,
                                                 std::span<const std::uint32_t> indices);

/// A motion past a plane: H ~ R + t n^T, that is t in units of the plane's distance from view a.
struct PlanarMotion {
  Rigid3 b_from_a;
  Eigen::Vector3d normal_in_a;  ///< Unit, n . x = 1 on the plane.
};

/// All motions that H, b ~ H a with a positive factor, can stem from: two pairs which differ in the
/// sign of t and n, or one motion without translation if H is a rotation
/// (Ma, Soatto, Kosecka & Sastry 2004, theorem 5.19).
std::vector<PlanarMotion> decompose_homography(const Eigen::Matrix3d& homography);

}  // namespace waymark

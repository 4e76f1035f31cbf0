// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// The essential matrix skew(t) * R of b_from_a, bearing_b^T * E * bearing_a = 0, with t scaled to
/// one. t must not be zero.
Eigen::Matrix3d essential_from_pose(const Rigid3& b_from_a);

/// All essential matrices (up to ten, of Frobenius norm sqrt(2), of either sign) that fit five
/// matched unit bearings: the five-point algorithm of Nister 2004. Bearings may point anywhere.
/// Degenerate samples give none or arbitrary ones, but always finite numbers.
std::vector<Eigen::Matrix3d> solve_five_point(std::span<const Eigen::Vector3d, 5> bearings_a,
                                              std::span<const Eigen::Vector3d, 5> bearings_b);

/// The four poses b_from_a of unit translation that have this essential matrix up to scale and sign
/// (Horn 1990, Recovering Baseline and Orientation from Essential Matrix): (R, t), (R, -t) and the
/// twisted pair. The matrix must be essential, as those of solve_five_point() are.
std::array<Rigid3, 4> decompose_essential(const Eigen::Matrix3d& essential);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

/// Squared Sampson distance (Luong & Faugeras 1996; Hartley & Zisserman 2004, eq. 11.9), on the
/// sphere instead of the image plane: the squared epipolar error b^T E a over its variance to first
/// order (and, which matters next to the epipoles, second order) in the noise of both bearings.
/// Chi-squared of 1 degree of freedom for a true match. E = skew(t) R with a unit t.
double squared_epipolar_error(const Eigen::Matrix3d& essential,
                              const BearingMatches& matches,
                              std::size_t index);

/// b_from_a (of unit translation) moved by a tangent vector: the rotation vector phi on the left
/// of the rotation, and tau in tangent_basis(t), after which t is made unit again. Order (phi,
/// tau).
Rigid3 perturb_relative_pose(const Rigid3& b_from_a, const Vector5d& tangent);

/// The signed epipolar error in standard deviations and its derivative by the tangent vector.
struct EpipolarResidual {
  double value;
  Vector5d jacobian;
};
EpipolarResidual epipolar_residual(const Rigid3& b_from_a,
                                   const BearingMatches& matches,
                                   std::size_t index);

/// Information (inverse covariance) of the tangent vector that the matches of these indices hold,
/// at a pose they agree with. Singular where they leave part of the motion open.
Matrix5d relative_pose_information(const Rigid3& b_from_a,
                                   const BearingMatches& matches,
                                   std::span<const std::uint32_t> indices);

struct RefinementOptions {
  double first_scale = 8.0;  ///< Of the loss, in standard deviations, for the first descent.
  double last_scale = 3.0;   ///< For the last one; scales in between are halved.
  int max_iterations = 10;   ///< Per scale.
};

/// Refines a relative pose of unit translation by Levenberg-Marquardt on the epipolar residuals of
/// the matches of these indices under the loss of Geman & McClure, loss(r) = r^2 s^2 / (r^2 + s^2),
/// whose scale s shrinks in steps: a wide scale leads over the local minima of a narrow one, a
/// narrow one takes the pull from the outliers (graduated non-convexity, Black & Rangarajan 1996;
/// Yang et al. 2020). Points need not be unknowns: to first order, the residual is the reprojection
/// error of the best point.
Rigid3 refine_relative_pose(const Rigid3& initial_b_from_a,
                            const BearingMatches& matches,
                            std::span<const std::uint32_t> indices,
                            const RefinementOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/ransac.h"

namespace waymark {

/// What the matches of two views have in common.
enum class TwoViewModel {
  kScene,     ///< An essential matrix: points anywhere.
  kPlane,     ///< A homography: points on one plane.
  kRotation,  ///< Nothing but a rotation: no parallax.
};

/// Squared epipolar error, in squared standard deviations, from which a match is an outlier: the
/// 95 % quantile of chi-squared of 1 degree of freedom.
inline constexpr double kMaxSquaredEpipolarError = 3.84;

using TwoViewFit = RansacResult<Eigen::Matrix3d>;

struct TwoViewModels {
  std::optional<TwoViewFit> essential, homography, rotation;
  TwoViewModel best = TwoViewModel::kScene;
  std::size_t num_inliers = 0;  ///< Of the best.
};

/// Fits the three models by ransac() and chooses between them by GRIC (Torr 1998).
TwoViewModels fit_two_view_models(const BearingMatches& matches, RansacOptions options);

}  // namespace waymark

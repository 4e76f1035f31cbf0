// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/ransac.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

struct TwoViewOptions {
  std::uint64_t seed = 0;
  std::uint64_t stream = 0;  ///< For example the frame: same seed and stream, same result.
  /// Matches that must agree with the motion and see their point under min_parallax_rad or more.
  int min_num_points = 50;
  double min_parallax_rad = 0.0175;  ///< About 1 degree.
};

/// What the matches of two views have in common.
enum class TwoViewModel {
  kScene,     ///< An essential matrix: points anywhere.
  kPlane,     ///< A homography: points on one plane.
  kRotation,  ///< Nothing but a rotation: no parallax.
};

enum class TwoViewStatus {
  kOk,
  kTooFewMatches,  ///< Fewer than min_num_points.
  kTooFewInliers,  ///< No model that enough of the matches agree with.
  /// A rotation explains the matches, too few points are near enough, or they leave the direction
  /// of motion open.
  kTooLittleParallax,
  kAmbiguous,  ///< Two motions explain the matches, for example past a plane.
};

/// Relative pose of two views and the points they see. Arrays run in parallel to the matches.
struct TwoViewGeometry {
  Rigid3 b_from_a;  ///< Translation of unit length.
  TwoViewModel model = TwoViewModel::kScene;
  std::vector<std::uint8_t> is_inlier;
  /// Whether an inlier has a point: its parallax and its angles from the direction of motion are at
  /// least four times their standard deviations, so its distances are known to about a quarter.
  std::vector<std::uint8_t> has_point;
  std::vector<Eigen::Vector3d> points_in_a;  ///< In units of the translation; zero if none.
  std::vector<double> parallaxes_rad;        ///< Zero where the match is no inlier.
};

struct TwoViewResult {
  TwoViewStatus status = TwoViewStatus::kTooFewMatches;
  std::optional<TwoViewGeometry> geometry;  ///< Present if and only if the status is kOk.
};

/// Estimates the relative pose of two views of a rigid scene from matches of which part are wrong.
/// Works for any central camera (points may lie behind), planes and general scenes alike.
///
/// Essential matrix, homography and rotation are each estimated by locally optimised RANSAC and
/// compared by GRIC (Torr 1998). Every pose that the first two allow is a candidate; candidates are
/// refined on all matches and compared by the epipolar errors and by the points that lie in front.
/// The best is the result, if it beats each different candidate significantly (Vuong 1989).
TwoViewResult estimate_two_view(const BearingMatches& matches, const TwoViewOptions& options);

/// Squared epipolar error, in squared standard deviations, from which a match is an outlier: the
/// 95 % quantile of chi-squared of 1 degree of freedom.
inline constexpr double kMaxSquaredEpipolarError = 3.84;

using TwoViewFit = RansacResult<Eigen::Matrix3d>;

struct TwoViewModels {
  std::optional<TwoViewFit> essential, homography, rotation;
  TwoViewModel best = TwoViewModel::kScene;
  std::size_t num_inliers = 0;  ///< Of the best.
  /// GRIC of the best, in squared standard deviations; infinite where there is none. Comparable
  /// between different bearings of the same matches.
  double cost = std::numeric_limits<double>::infinity();
};

/// The first step of it: fits the three models by ransac() and chooses between them by GRIC (Torr
/// 1998).
TwoViewModels fit_two_view_models(const BearingMatches& matches, RansacOptions options);

}  // namespace waymark

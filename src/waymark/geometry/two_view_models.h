// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/ransac.h"

namespace waymark {

/// What the matches of two views have in common.
enum class TwoViewModel {
  kScene,     ///< An essential matrix: points anywhere.
  kPlane,     ///< A homography: points on one plane.
  kRotation,  ///< Nothing but a rotation: no parallax.
};

// The three models as estimators for ransac(). Each keeps a view of the matches. Thresholds are the
// 95 % quantiles of chi-squared of 1 and 2 degrees of freedom.

/// Essential matrices of any scene seen from two places.
class EssentialEstimator {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = 5;
  static constexpr double kMaxSquaredError = 3.84;

  explicit EssentialEstimator(const BearingMatches& matches) : matches_(matches) {}
  std::size_t num_data() const { return matches_.size(); }
  std::vector<Eigen::Matrix3d> fit(std::span<const std::uint32_t, kSampleSize> sample) const;
  double squared_error(const Eigen::Matrix3d& essential, std::size_t index) const;
  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& essential,
                                        std::span<const std::uint32_t> nearby) const;

 private:
  BearingMatches matches_;
};

/// Homographies of a plane seen from two places.
class HomographyEstimator {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = 4;
  static constexpr double kMaxSquaredError = 5.99;

  explicit HomographyEstimator(const BearingMatches& matches) : matches_(matches) {}
  std::size_t num_data() const { return matches_.size(); }
  std::vector<Eigen::Matrix3d> fit(std::span<const std::uint32_t, kSampleSize> sample) const;
  double squared_error(const Eigen::Matrix3d& homography, std::size_t index) const;
  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& homography,
                                        std::span<const std::uint32_t> nearby) const;

 private:
  BearingMatches matches_;
};

/// Rotations of any scene seen from one place, or of a scene far away.
class RotationEstimator {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = 2;
  static constexpr double kMaxSquaredError = 5.99;

  explicit RotationEstimator(const BearingMatches& matches) : matches_(matches) {}
  std::size_t num_data() const { return matches_.size(); }
  std::vector<Eigen::Matrix3d> fit(std::span<const std::uint32_t, kSampleSize> sample) const;
  double squared_error(const Eigen::Matrix3d& rotation, std::size_t index) const;
  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& rotation,
                                        std::span<const std::uint32_t> nearby) const;

 private:
  double variance(std::size_t index) const;

  BearingMatches matches_;
};

using TwoViewFit = RansacResult<Eigen::Matrix3d>;

struct TwoViewModels {
  std::optional<TwoViewFit> essential, homography, rotation;
  TwoViewModel best = TwoViewModel::kScene;
  std::size_t num_inliers = 0;  ///< Of the best.
};

/// Fits the three models by ransac() and chooses between them by GRIC (Torr 1998).
TwoViewModels fit_two_view_models(const BearingMatches& matches, RansacOptions options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// All poses cam_from_world in which a camera sees three known points along three unit bearings, at
/// most four. The bearings may point anywhere: a point lies ahead along its own bearing, nothing is
/// asked of z. None if the points lie on a line, two of them coincide or a value is not finite.
///
/// Distances along the bearings by the pencil of the two homogeneous quadrics of Persson & Nordberg
/// 2018 (Lambda Twist); its degenerate member is split into two planes by its adjugate
/// (Richter-Gebert 2011, 11.1) instead of eigenvectors, and the planes are met with the pencil
/// without singling out one of the distances.
std::vector<Rigid3> solve_absolute_three_point(std::span<const Eigen::Vector3d, 3> bearings,
                                               std::span<const Eigen::Vector3d, 3> points_in_world);

/// Unit bearings that a camera measured of points with known positions, and the standard deviation
/// of each bearing's direction in radians, per axis of the tangent plane (> 0). A view: the arrays
/// belong to the caller and run in parallel.
struct PointObservations {
  std::span<const Eigen::Vector3d> points_in_world;
  std::span<const Eigen::Vector3d> bearings;
  std::span<const double> sigmas_rad;

  std::size_t size() const { return bearings.size(); }
};

/// Poses cam_from_world as an estimator for ransac(). The error is the chord between the predicted
/// and the measured bearing, so that a point behind its bearing is an outlier; the threshold is the
/// 95 % quantile of chi-squared of 2 degrees of freedom.
class AbsolutePoseEstimator {
 public:
  using Model = Rigid3;
  static constexpr std::size_t kSampleSize = 3;
  static constexpr double kMaxSquaredError = 5.99;

  explicit AbsolutePoseEstimator(const PointObservations& observations)
      : observations_(observations) {}
  std::size_t num_data() const { return observations_.size(); }
  std::vector<Rigid3> fit(std::span<const std::uint32_t, kSampleSize> sample) const;
  double squared_error(const Rigid3& cam_from_world, std::size_t index) const;
  /// Gauss-Newton steps under the loss of Geman & McClure.
  std::optional<Rigid3> refine(const Rigid3& cam_from_world,
                               std::span<const std::uint32_t> nearby) const;

 private:
  PointObservations observations_;
};

}  // namespace waymark

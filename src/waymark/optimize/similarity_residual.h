// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/camera/measurement.h"
#include "waymark/geometry/sim3.h"

namespace waymark {

/// Pairs of landmarks that may be the same thing, one of each pair known and seen by camera a, the
/// other by camera b. Points are in the frame of the camera that sees them, in the units of its
/// part of the map. Parallel arrays.
struct LandmarkMatches {
  struct Side {
    std::vector<Eigen::Vector3d> point_in_cam;
    std::vector<Eigen::Vector3f> bearing;             ///< Measured, unit.
    std::vector<Matrix23f> level_pixel_from_bearing;  ///< W of Features.

    void add(const Eigen::Vector3d& point, const Measurement& measured) {
      point_in_cam.push_back(point);
      bearing.push_back(measured.bearing);
      level_pixel_from_bearing.push_back(measured.level_pixel_from_bearing);
    }
  };
  Side a, b;

  std::size_t size() const { return a.point_in_cam.size(); }
};

/// Residuals of one match and their derivatives by the left perturbation of b_from_a.
struct SimilarityResidual {
  /// W * (predicted - measured bearing) of the landmark of a in b, then of that of b in a.
  Eigen::Vector4d value;
  Eigen::Matrix<double, 4, 7> jacobian;
  /// Logarithm of the ratio of the ranges, in b, of the landmark of a and that of b. Bearings tell
  /// the scale by the distance of the cameras only, and there may be none.
  double log_range_ratio;
  Eigen::Matrix<double, 1, 7> log_range_jacobian;
};

/// Nothing if a landmark is more than 90 degrees from its bearing, or if a value is not finite.
std::optional<SimilarityResidual> similarity_residual(const Sim3& b_from_a,
                                                      const LandmarkMatches& matches,
                                                      std::size_t index);

/// Sum of the squared components of SimilarityResidual::value in px^2; kGrossSquaredResidual if
/// there is none. a_from_b is the inverse of b_from_a.
double squared_similarity_residual(const Sim3& b_from_a,
                                   const Sim3& a_from_b,
                                   const LandmarkMatches& matches,
                                   std::size_t index);

}  // namespace waymark

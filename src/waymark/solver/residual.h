// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "waymark/camera/camera.h"

namespace waymark {

/// Squared residual, in px^2, that a point more than 90 degrees from its bearing counts as. The
/// true one shrinks again towards the antipode, where the tangent plane cannot tell the two apart.
inline constexpr double kGrossSquaredResidual = 1e6;

/// A point in the frame of a camera by its direction and inverse range, which is what is measured.
struct InverseRangePoint {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit; zero at the camera's centre.
  double inverse_range = 0.0;                           ///< 1/m
};

inline InverseRangePoint in_inverse_range(const Eigen::Vector3d& point_in_cam) {
  const double inverse_range = 1.0 / std::sqrt(std::max(point_in_cam.squaredNorm(), 1e-24));
  return {point_in_cam * inverse_range, inverse_range};
}

/// Whether the residual means anything: the point lies within 90 degrees of the bearing. False
/// for values that are not finite.
inline bool is_ahead(const InverseRangePoint& point, const Eigen::Vector3f& bearing) {
  return point.direction.dot(bearing.cast<double>()) > 0.0;
}

/// W * (predicted - measured bearing), in pixels of the feature's level.
inline Eigen::Vector2d bearing_residual(const InverseRangePoint& point,
                                        const Eigen::Vector3f& bearing,
                                        const Matrix23f& level_pixel_from_bearing) {
  return level_pixel_from_bearing.cast<double>() * (point.direction - bearing.cast<double>());
}

/// Its derivative by the point in the camera: W * (I - p p^T) / range, with p the direction.
inline Matrix23d bearing_residual_by_point(const InverseRangePoint& point,
                                           const Matrix23f& level_pixel_from_bearing) {
  const Matrix23d w = level_pixel_from_bearing.cast<double>();
  const Eigen::Vector2d along = w * point.direction;
  return point.inverse_range * (w - along * point.direction.transpose());
}

/// (1 / range - measured) / sigma; sigma > 0.
inline double range_residual(const InverseRangePoint& point, double inverse_range, double sigma) {
  return (point.inverse_range - inverse_range) / sigma;
}

inline Eigen::RowVector3d range_residual_by_point(const InverseRangePoint& point, double sigma) {
  return point.direction.transpose() * (-point.inverse_range * point.inverse_range / sigma);
}

/// Directions less along z than this, 84 degrees off, have no depth that tells anything.
inline constexpr double kLeastAlongZ = 0.1;

/// The same of a depth: (1 / z - measured) / sigma. No calibration has a part in it.
inline double depth_residual(const InverseRangePoint& point, double inverse_depth, double sigma) {
  const double along_z = std::max(point.direction.z(), kLeastAlongZ);
  return (point.inverse_range / along_z - inverse_depth) / sigma;
}

inline Eigen::RowVector3d depth_residual_by_point(const InverseRangePoint& point, double sigma) {
  if (point.direction.z() < kLeastAlongZ) {
    return range_residual_by_point(point, kLeastAlongZ * sigma);
  }
  const double inverse_depth = point.inverse_range / point.direction.z();
  return {0.0, 0.0, -inverse_depth * inverse_depth / sigma};
}

}  // namespace waymark

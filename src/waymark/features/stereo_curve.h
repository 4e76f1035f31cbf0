// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "waymark/camera/rig.h"

namespace waymark {

/// The ray of a feature of camera 0, seen from camera 1. The directions of its points in camera 1
/// lie in the epipolar plane; they are counted by the angle from the direction of the point at
/// infinity, towards that of camera 0's centre. Unlike inverse range or pixels, equal angles are
/// about equal distances in the image of any camera.
struct EpipolarRay {
  Eigen::Vector3d infinity;  ///< Unit: the bearing, rotated into camera 1.
  Eigen::Vector3d toward;    ///< Unit, perpendicular to it, in the epipolar plane.
  double baseline_along_m;   ///< Origin of camera 0 in camera 1: its part along `infinity`,
  double baseline_across_m;  ///< and along `toward`; not negative.

  EpipolarRay(const Rigid3& cam1_from_cam0, const Eigen::Vector3d& bearing0);

  Eigen::Vector3d direction(double angle_rad) const;
  /// Derivative of the direction by the angle; unit.
  Eigen::Vector3d direction_derivative(double angle_rad) const;
  /// Angle of the point at an inverse range from camera 0.
  double angle(double inverse_range) const;
  /// Inverse range from camera 0 of the point at an angle; negative behind infinity.
  double inverse_range(double angle_rad) const;
};

/// A point of an epipolar curve.
struct CurveNode {
  double angle_rad;
  Eigen::Vector2d pixel;  ///< In camera 1, level 0.
};

/// The epipolar curves of many features, sampled for search. Keeps its buffers.
class EpipolarCurves {
 public:
  /// Distance of neighbouring nodes in pixels of the feature's level. At that distance the curve
  /// leaves the chord by less than 0.1 px even in strongly distorted images.
  static constexpr double kNodeDistancePx = 16.0;
  /// Search starts that far behind infinity, since corners far away have disparities of either
  /// sign.
  static constexpr double kBehindInfinityPx = 2.0;

  EpipolarCurves(const Rig& rig, double min_range_m);

  /// size_rad: angle of a pixel of the feature's level.
  void compute(std::span<const Eigen::Vector3f> bearings0, std::span<const float> size_rad);

  const EpipolarRay& ray(std::size_t feature) const { return rays_[feature]; }
  /// Longest run of nodes in the image of camera 1, by ascending angle.
  std::span<const CurveNode> nodes(std::size_t feature) const;

 private:
  void add_directions(const EpipolarRay& ray, double size_rad);
  void keep_longest_run(std::size_t begin, std::size_t end);

  std::shared_ptr<const Camera> camera1_;
  Rigid3 cam1_from_cam0_;
  double max_inverse_range_;
  std::vector<EpipolarRay> rays_;
  std::vector<std::size_t> direction_begin_;  // Per feature, one more for the end.
  std::vector<double> angles_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<std::uint8_t> is_visible_;
  std::vector<CurveNode> nodes_;
  std::vector<std::size_t> node_begin_;
};

}  // namespace waymark

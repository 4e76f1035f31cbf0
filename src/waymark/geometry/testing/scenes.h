// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Random two-view scenes with known answers, for tests and benchmarks of this module only.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/bearing.h"
#include "waymark/geometry/rigid3.h"

namespace waymark::testing {

struct TwoViewScene {
  Rigid3 b_from_a;  ///< Translation of any length.
  std::vector<Eigen::Vector3d> points_in_a;
  std::vector<Eigen::Vector3d> bearings_a, bearings_b;
  std::vector<double> sigmas_rad_a, sigmas_rad_b;
  std::vector<std::uint8_t> is_outlier;

  BearingMatches matches() const { return {bearings_a, bearings_b, sigmas_rad_a, sigmas_rad_b}; }
  std::vector<std::uint32_t> indices() const {
    std::vector<std::uint32_t> all(bearings_a.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }
};

/// What a camera sees: everything, or a pyramid around +z of these half angles.
struct View {
  bool sees_all = false;
  double tan_half_width = 1.0;
  double tan_half_height = 0.6;

  bool contains(const Eigen::Vector3d& v) const {
    return sees_all || (v.z() > 0.0 && std::abs(v.x()) < tan_half_width * v.z() &&
                        std::abs(v.y()) < tan_half_height * v.z());
  }
};

inline Eigen::Vector3d random_vector(Rng& rng) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return {x, y, z};
}

inline Eigen::Vector3d random_direction(Rng& rng) { return random_vector(rng).normalized(); }

inline Eigen::Vector3d random_bearing(Rng& rng, const View& view) {
  if (view.sees_all) return random_direction(rng);
  const double x = rng.uniform(-view.tan_half_width, view.tan_half_width);
  const double y = rng.uniform(-view.tan_half_height, view.tan_half_height);
  return Eigen::Vector3d(x, y, 1.0).normalized();
}

inline Rigid3 random_pose(Rng& rng, double angle_rad, double distance) {
  const Eigen::Vector3d axis = random_direction(rng);
  return {so3_exp(angle_rad * axis), distance * random_direction(rng)};
}

/// Adds noise of sigma_rad per tangent axis.
inline Eigen::Vector3d disturb(const Eigen::Vector3d& bearing, double sigma_rad, Rng& rng) {
  const double x = sigma_rad * rng.normal(), y = sigma_rad * rng.normal();
  return (bearing + tangent_basis(bearing) * Eigen::Vector2d(x, y)).normalized();
}

/// Points drawn by `draw_point(rng)` in frame a until num_matches are seen by both views; a share
/// of the matches is wrong, which means a random bearing in b.
template <class DrawPoint>
TwoViewScene make_scene(const Rigid3& b_from_a,
                        const View& view,
                        std::size_t num_matches,
                        double sigma_rad,
                        double outlier_share,
                        Rng& rng,
                        DrawPoint&& draw_point) {
  TwoViewScene scene;
  scene.b_from_a = b_from_a;
  while (scene.points_in_a.size() < num_matches) {
    const Eigen::Vector3d point_in_a = draw_point(rng);
    const Eigen::Vector3d point_in_b = b_from_a * point_in_a;
    if (!view.contains(point_in_a) || !view.contains(point_in_b)) continue;
    const bool is_outlier = rng.uniform() < outlier_share;
    const Eigen::Vector3d seen_in_b = is_outlier ? random_bearing(rng, view) : point_in_b;
    scene.points_in_a.push_back(point_in_a);
    scene.bearings_a.push_back(disturb(point_in_a.normalized(), sigma_rad, rng));
    scene.bearings_b.push_back(disturb(seen_in_b.normalized(), sigma_rad, rng));
    scene.sigmas_rad_a.push_back(sigma_rad);
    scene.sigmas_rad_b.push_back(sigma_rad);
    scene.is_outlier.push_back(is_outlier);
  }
  return scene;
}

inline double rotation_error_rad(const Rigid3& estimate, const Rigid3& truth) {
  return estimate.rotation.angularDistance(truth.rotation);
}

inline double direction_error_rad(const Rigid3& estimate, const Rigid3& truth) {
  return angle_between(estimate.translation, truth.translation);
}

/// The value below which the given share of the values lies.
inline double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "waymark/base/rng.h"
#include "waymark/solver/bundle_problem.h"
#include "waymark/solver/pose_observations.h"

/// Synthetic measurements for the tests and benchmarks of this module.
namespace waymark::testing {

inline Eigen::Vector3d random_vector(Rng& rng, double sigma) {
  const double x = rng.normal();
  const double y = rng.normal();
  return sigma * Eigen::Vector3d(x, y, rng.normal());
}

inline Vector6d random_tangent(Rng& rng, double sigma_translation, double sigma_rotation) {
  Vector6d tangent;
  tangent.head<3>() = random_vector(rng, sigma_translation);
  tangent.tail<3>() = random_vector(rng, sigma_rotation);
  return tangent;
}

/// W of a camera with focal_px pixels per radian everywhere, in some basis of the tangent plane.
inline Matrix23d pixel_from_bearing(const Eigen::Vector3d& bearing, double focal_px) {
  const Eigen::Vector3d side =
      std::abs(bearing.x()) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d u = bearing.cross(side).normalized();
  Matrix23d w;
  w.row(0) = focal_px * u.transpose();
  w.row(1) = focal_px * bearing.cross(u).transpose();
  return w;
}

/// Sees a point with noise_px in each direction at one of four pyramid levels.
inline Measurement measure(const Eigen::Vector3d& point_in_cam, double noise_px, Rng& rng) {
  const double focal_px = 400.0 / std::pow(1.2, rng.below(4));
  const Eigen::Vector3d direction = point_in_cam.normalized();
  const Matrix23d w = pixel_from_bearing(direction, focal_px);
  const double dx = noise_px * rng.normal();
  const double dy = noise_px * rng.normal();
  const Eigen::Vector3d measured =
      (direction + w.transpose() * Eigen::Vector2d(dx, dy) / (focal_px * focal_px)).normalized();
  return {0, measured.cast<float>(), pixel_from_bearing(measured, focal_px).cast<float>()};
}

/// Cameras that look forward, left, ... half a metre apart, slightly rotated.
inline Rig make_rig(std::size_t num_cameras) {
  Rig rig;
  for (std::size_t i = 0; i < num_cameras; ++i) {
    Vector6d tangent;
    tangent << -0.5 * static_cast<double>(i), 0.0, 0.0, 0.0, 0.1 * static_cast<double>(i), 0.02;
    rig.cameras.push_back({nullptr, i == 0 ? Rigid3() : Rigid3::exp(tangent)});
  }
  return rig;
}

struct PoseScene {
  Rig rig;
  Rigid3 rig_from_world;  ///< The truth.
  PoseObservations observations;
  std::vector<std::uint8_t> is_inlier;
};

struct PoseSceneOptions {
  std::size_t num_observations = 300;
  std::size_t num_cameras = 1;
  double noise_px = 1.0;
  double share_of_outliers = 0.0;  ///< Bearings up to 60 px off.
  double range_sigma = 0.0;        ///< Of inverse ranges, 1/m; 0 for none.
};

inline PoseScene make_pose_scene(const PoseSceneOptions& options, std::uint64_t seed) {
  Rng rng(seed, 0);
  PoseScene scene;
  scene.rig = make_rig(options.num_cameras);
  scene.rig_from_world = Rigid3::exp(random_tangent(rng, 3.0, 1.0));
  for (std::size_t i = 0; i < options.num_observations; ++i) {
    const auto camera = static_cast<std::uint8_t>(i % options.num_cameras);
    const double z = rng.uniform(2.0, 20.0);
    const double x = z * rng.uniform(-0.8, 0.8);
    const Eigen::Vector3d point_in_cam(x, z * rng.uniform(-0.6, 0.6), z);
    const Rigid3 cam_from_world = scene.rig.cameras[camera].cam_from_rig * scene.rig_from_world;
    const bool is_inlier = rng.uniform() >= options.share_of_outliers;
    Measurement measurement = measure(point_in_cam, options.noise_px, rng);
    if (!is_inlier) {
      const double angle = rng.uniform(0.0, 6.28);
      const double offset_px = rng.uniform(8.0, 60.0);
      const Eigen::Vector3d side(std::cos(angle), std::sin(angle), 0.0);
      measurement = measure(point_in_cam.normalized() + side * offset_px / 230.0, 0.0, rng);
    }
    auto& observations = scene.observations;
    observations.point_in_world.push_back(cam_from_world.inverse() * point_in_cam);
    observations.bearing.push_back(measurement.bearing);
    observations.level_pixel_from_bearing.push_back(measurement.level_pixel_from_bearing);
    observations.camera.push_back(camera);
    if (options.range_sigma > 0.0) {
      const double inverse_range = 1.0 / point_in_cam.norm() + options.range_sigma * rng.normal();
      observations.inverse_range.push_back(static_cast<float>(inverse_range));
      observations.inverse_range_sigma.push_back(static_cast<float>(options.range_sigma));
    }
    scene.is_inlier.push_back(is_inlier);
  }
  return scene;
}

struct BundleSceneOptions {
  std::size_t num_poses = 8;
  std::size_t num_fixed = 2;  ///< The first ones.
  std::size_t num_points = 200;
  std::size_t views_per_point = 4;  ///< Neighbouring poses.
  /// Where the way turns back, beside itself: half of the views of a point are of the next row.
  /// 0: one row.
  std::size_t poses_per_row = 0;
  std::size_t num_cameras = 1;
  double noise_px = 1.0;
  double share_of_outliers = 0.0;
  double range_sigma = 0.0;
  double point_error = 0.1;  ///< Of the start, m per axis.
  double pose_error = 0.02;  ///< Of the start of free poses, m and rad.
};

struct BundleScene {
  Rig rig;
  std::vector<Rigid3> rig_from_world;   ///< The truth.
  std::vector<Eigen::Vector3d> points;  ///< The truth.
  std::vector<std::uint8_t> is_outlier;
  BundleProblem problem;  ///< Its rig must be set to &rig where the scene has come to rest.
};

inline void observe(const BundleSceneOptions& options,
                    std::uint32_t pose,
                    std::uint32_t point,
                    Rng& rng,
                    BundleScene& scene) {
  for (std::size_t camera = 0; camera < options.num_cameras; ++camera) {
    const Rigid3& cam_from_rig = scene.rig.cameras[camera].cam_from_rig;
    const Eigen::Vector3d point_in_cam =
        cam_from_rig * (scene.rig_from_world[pose] * scene.points[point]);
    const bool is_outlier = rng.uniform() < options.share_of_outliers;
    const Eigen::Vector3d seen =
        is_outlier ? point_in_cam + random_vector(rng, 0.3 * point_in_cam.norm()) : point_in_cam;
    BundleObservation observation{measure(seen, options.noise_px, rng), pose, point};
    observation.camera = static_cast<std::uint8_t>(camera);
    if (options.range_sigma > 0.0) {
      const double inverse_range = 1.0 / point_in_cam.norm() + options.range_sigma * rng.normal();
      observation.inverse_range = static_cast<float>(inverse_range);
      observation.inverse_range_sigma = static_cast<float>(options.range_sigma);
    }
    scene.problem.observations.push_back(observation);
    scene.is_outlier.push_back(is_outlier);
  }
}

/// Poses along a gentle curve, points beside it.
inline BundleScene make_bundle_scene(const BundleSceneOptions& options, std::uint64_t seed) {
  Rng rng(seed, 1);
  BundleScene scene;
  scene.rig = make_rig(options.num_cameras);
  for (std::size_t i = 0; i < options.num_poses; ++i) {
    Vector6d tangent = random_tangent(rng, 0.05, 0.05);
    const std::size_t row = options.poses_per_row > 0 ? i / options.poses_per_row : 0;
    tangent[0] += 0.4 * static_cast<double>(i - row * options.poses_per_row);
    tangent[1] += 0.4 * static_cast<double>(row);
    scene.rig_from_world.push_back(Rigid3::exp(tangent).inverse());
    const bool is_fixed = i < options.num_fixed;
    const Vector6d error = random_tangent(rng, options.pose_error, options.pose_error);
    scene.problem.rig_from_world.push_back((is_fixed ? Rigid3() : Rigid3::exp(error)) *
                                           scene.rig_from_world.back());
    scene.problem.is_pose_fixed.push_back(is_fixed);
  }
  const bool has_rows = options.poses_per_row > 0;
  const std::size_t num_rows = has_rows ? options.num_poses / options.poses_per_row : 1;
  const std::size_t num_views = has_rows ? options.views_per_point / 2 : options.views_per_point;
  const std::size_t row_length = has_rows ? options.poses_per_row : options.num_poses;
  for (std::size_t i = 0; i < options.num_points; ++i) {
    const auto start = rng.below(static_cast<std::uint32_t>(row_length - num_views) + 1);
    const auto row = has_rows ? rng.below(static_cast<std::uint32_t>(num_rows) - 1) : 0;
    const double middle = 0.4 * (static_cast<double>(start) + 0.5 * static_cast<double>(num_views));
    const double x = middle + rng.uniform(-1.5, 1.5);
    const double y = 0.4 * row + rng.uniform(-1.5, 1.5);
    scene.points.emplace_back(x, y, rng.uniform(2.0, 8.0));
    scene.problem.points.push_back(scene.points.back() + random_vector(rng, options.point_error));
    for (std::size_t view = 0; view < options.views_per_point; ++view) {
      const std::size_t row_of_view = row + view / num_views;
      const std::size_t pose = row_of_view * row_length + start + view % num_views;
      observe(options, static_cast<std::uint32_t>(pose), static_cast<std::uint32_t>(i), rng, scene);
    }
  }
  return scene;
}

}  // namespace waymark::testing

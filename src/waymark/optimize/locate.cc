// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/locate.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/geometry/absolute_pose.h"

namespace waymark {
namespace {

struct CameraObservations {
  std::vector<Eigen::Vector3d> points_in_world, bearings;
  std::vector<double> sigmas_rad;

  PointObservations view() const { return {points_in_world, bearings, sigmas_rad}; }
};

std::size_t busiest_camera(const Rig& rig, const PoseObservations& observations) {
  std::vector<std::size_t> counts(rig.cameras.size(), 0);
  for (const std::uint8_t camera : observations.camera) {
    if (camera < counts.size()) ++counts[camera];
  }
  return static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

CameraObservations observations_of(std::size_t camera, const PoseObservations& observations) {
  CameraObservations of_camera;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations.camera[i] != camera) continue;
    // Pixels per radian; the root of the mean square over the directions where they differ.
    const double resolution = observations.level_pixel_from_bearing[i].norm() / std::sqrt(2.0);
    const double sigma_rad = 1.0 / resolution;
    const Eigen::Vector3d bearing = observations.bearing[i].cast<double>();
    const bool is_finite = bearing.allFinite() && observations.point_in_world[i].allFinite();
    if (!is_finite || !(sigma_rad > 0.0) || !std::isfinite(sigma_rad)) continue;
    of_camera.points_in_world.push_back(observations.point_in_world[i]);
    of_camera.bearings.push_back(bearing);
    of_camera.sigmas_rad.push_back(sigma_rad);
  }
  return of_camera;
}

}  // namespace

std::optional<PoseEstimate> locate(const Rig& rig,
                                   const PoseObservations& observations,
                                   const RansacOptions& ransac_options,
                                   PoseWorkspace& workspace) {
  const std::size_t camera = busiest_camera(rig, observations);
  if (camera >= rig.cameras.size()) return std::nullopt;
  const CameraObservations of_camera = observations_of(camera, observations);
  const auto consensus = ransac(AbsolutePoseEstimator(of_camera.view()), ransac_options);
  if (!consensus) return std::nullopt;
  const Rigid3 rig_from_world = rig.cameras[camera].cam_from_rig.inverse() * consensus->model;
  return optimize_pose(rig, observations, rig_from_world, workspace);
}

}  // namespace waymark

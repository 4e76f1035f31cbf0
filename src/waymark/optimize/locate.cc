// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/locate.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/geometry/absolute_pose.h"

namespace waymark {
namespace {

struct CameraSightings {
  std::vector<Eigen::Vector3d> points_in_world, bearings;
  std::vector<double> sigmas_rad;

  PointSightings view() const { return {points_in_world, bearings, sigmas_rad}; }
};

std::size_t busiest_camera(const Rig& rig, const PoseObservations& observations) {
  std::vector<std::size_t> counts(rig.cameras.size(), 0);
  for (const std::uint8_t camera : observations.camera) {
    if (camera < counts.size()) ++counts[camera];
  }
  return static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

CameraSightings sightings_of(std::size_t camera, const PoseObservations& observations) {
  CameraSightings sightings;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations.camera[i] != camera) continue;
    // Pixels per radian; the root of the mean square over the directions where they differ.
    const double resolution = observations.level_pixel_from_bearing[i].norm() / std::sqrt(2.0);
    const double sigma_rad = 1.0 / resolution;
    const Eigen::Vector3d bearing = observations.bearing[i].cast<double>();
    const bool is_finite = bearing.allFinite() && observations.point_in_world[i].allFinite();
    if (!is_finite || !(sigma_rad > 0.0) || !std::isfinite(sigma_rad)) continue;
    sightings.points_in_world.push_back(observations.point_in_world[i]);
    sightings.bearings.push_back(bearing);
    sightings.sigmas_rad.push_back(sigma_rad);
  }
  return sightings;
}

}  // namespace

std::optional<PoseEstimate> locate(const Rig& rig,
                                   const PoseObservations& observations,
                                   const RansacOptions& ransac_options,
                                   PoseWorkspace& workspace) {
  const std::size_t camera = busiest_camera(rig, observations);
  if (camera >= rig.cameras.size()) return std::nullopt;
  const CameraSightings sightings = sightings_of(camera, observations);
  const auto consensus = ransac(AbsolutePoseEstimator(sightings.view()), ransac_options);
  if (!consensus) return std::nullopt;
  const Rigid3 rig_from_world = rig.cameras[camera].cam_from_rig.inverse() * consensus->model;
  return optimize_pose(rig, observations, rig_from_world, workspace);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/map_view.h"

#include "waymark/track/frame_locator.h"

namespace waymark {
namespace {

/// What is left of a view, with the points where they are now.
PoseObservations living_observations(const MapView& view, const Map& map) {
  PoseObservations living;
  for (std::size_t i = 0; i < view.landmarks.size(); ++i) {
    const LandmarkId id = map.resolve(view.landmarks[i]);
    if (!id.is_valid()) continue;
    living.point_in_world.push_back(map.landmarks().at(id).position_in_world);
    living.bearing.push_back(view.observations.bearing[i]);
    living.level_pixel_from_bearing.push_back(view.observations.level_pixel_from_bearing[i]);
    living.camera.push_back(view.observations.camera[i]);
    living.inverse_range.push_back(view.observations.inverse_range[i]);
    living.inverse_range_sigma.push_back(view.observations.inverse_range_sigma[i]);
  }
  return living;
}

}  // namespace

MapView view_of(const Features& features, std::span<const LandmarkId> landmarks) {
  MapView view;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (!landmarks[i].is_valid()) continue;
    view.landmarks.push_back(landmarks[i]);
    append_observation(features, i, Eigen::Vector3d::Zero(), view.observations);
  }
  return view;
}

std::optional<RelativePose> locate_again(const MapView& view,
                                         const Map& map,
                                         const Rig& rig,
                                         const RelativePose& pose,
                                         PoseWorkspace& workspace) {
  const PoseObservations living = living_observations(view, map);
  if (2 * living.size() < view.landmarks.size()) return std::nullopt;
  const Rigid3 initial =
      map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
  const PoseEstimate estimate = optimize_pose(rig, living, initial, PoseOptions{}, workspace);
  if (2 * estimate.num_inliers < view.landmarks.size()) return std::nullopt;
  const KeyframeId id = map.resolve(pose.reference);
  const Keyframe& reference = map.keyframes().at(id);
  return RelativePose{
      id, estimate.rig_from_world * reference.rig_from_world.inverse(), reference.applied_scale};
}

}  // namespace waymark

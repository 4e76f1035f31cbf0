// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/associate.h"

#include "waymark/features/range_precision.h"

namespace waymark {

std::optional<double> squared_residual(const Keyframe& keyframe,
                                       std::uint32_t feature,
                                       const Eigen::Vector3d& point_in_world) {
  const Features& features = *keyframe.features;
  const RigCamera& camera = keyframe.rig().cameras[features.keypoints[feature].camera];
  const Eigen::Vector3d predicted =
      (camera.cam_from_rig * (keyframe.rig_from_world * point_in_world)).normalized();
  const Eigen::Vector3d measured = features.bearings[feature].cast<double>();
  if (predicted.dot(measured) <= 0.0) return std::nullopt;
  const Matrix23d w = features.level_pixel_from_bearing[feature].cast<double>();
  return (w * (predicted - measured)).squaredNorm();
}

bool agrees(const Keyframe& keyframe,
            std::uint32_t feature,
            const Eigen::Vector3d& point_in_world) {
  const std::optional<double> squared = squared_residual(keyframe, feature, point_in_world);
  return squared && *squared < kMaxSquaredResidual;
}

int add_landmarks_from_range(Map& map, KeyframeId id, DirtyLandmarks& dirty) {
  const std::shared_ptr<const Features> features = map.keyframes().at(id).features;
  const std::shared_ptr<const Rig> rig = map.keyframes().at(id).features->rig;
  const SubmapId submap = map.keyframes().at(id).submap;
  const Rigid3 world_from_cam =
      (rig->cameras[0].cam_from_rig * map.keyframes().at(id).rig_from_world).inverse();
  int num_added = 0;
  for (std::uint32_t i = 0; i < features->num_primary; ++i) {
    if (map.keyframes().at(id).landmarks[i].is_valid()) continue;
    if (!has_reliable_range(*features, i)) continue;
    const Eigen::Vector3d point = features->range_m[i] * features->bearings[i].cast<double>();
    const LandmarkId landmark = map.add_landmark(submap, world_from_cam * point, id);
    map.observe(id, i, landmark);
    dirty.insert(landmark);
    ++num_added;
  }
  return num_added;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/appearance.h"

namespace waymark {

Appearance describe_landmark(const Map& map, LandmarkId id) {
  const Landmark& landmark = map.landmarks().at(id);
  Appearance appearance;
  bool is_described = false;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Features& features = *keyframe.features;
    if (observation.feature >= features.num_primary) continue;
    const Rigid3 cam_from_world = keyframe.rig->cameras[0].cam_from_rig * keyframe.rig_from_world;
    const Eigen::Vector3d to_camera =
        cam_from_world.origin_in_source() - landmark.position_in_world;
    const double distance = to_camera.norm();
    appearance.direction += to_camera / distance;
    appearance.descriptor = features.descriptors[observation.feature];
    is_described = true;
    if (observation.keyframe == landmark.reference || appearance.size_m == 0.0) {
      appearance.size_m = distance * features.size_rad[observation.feature];
    }
  }
  if (!is_described) return landmark.appearance;
  appearance.direction.normalize();
  return appearance;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/appearance.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "waymark/image/hamming.h"

namespace waymark {
namespace {

/// More descriptors than this hardly change the medoid; the newest are taken.
constexpr std::size_t kMaxDescriptors = 10;

/// The medoid: that with the least sum of distances to the others (Kaufman and Rousseeuw 1990).
Descriptor medoid(std::span<const Descriptor* const> descriptors) {
  const Descriptor* best = nullptr;
  int least_sum = INT32_MAX;
  for (const Descriptor* candidate : descriptors) {
    int sum = 0;
    for (const Descriptor* other : descriptors) sum += hamming_distance(*candidate, *other);
    if (sum < least_sum) {
      least_sum = sum;
      best = candidate;
    }
  }
  return *best;
}

}  // namespace

Appearance describe_landmark(const Map& map, LandmarkId id) {
  const Landmark& landmark = map.landmarks().at(id);
  Appearance appearance;
  std::vector<const Descriptor*> descriptors;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Features& features = *keyframe.features;
    if (observation.feature >= features.num_primary) continue;
    const Rigid3 cam_from_world = keyframe.rig->cameras[0].cam_from_rig * keyframe.rig_from_world;
    const Eigen::Vector3d to_camera =
        cam_from_world.origin_in_source() - landmark.position_in_world;
    const double distance = to_camera.norm();
    appearance.direction += to_camera / distance;
    descriptors.push_back(&features.descriptors[observation.feature]);
    if (observation.keyframe == landmark.reference || appearance.size_m == 0.0) {
      appearance.size_m = distance * features.size_rad[observation.feature];
    }
  }
  if (descriptors.empty()) return landmark.appearance;
  appearance.direction.normalize();
  const std::size_t num_used = std::min(descriptors.size(), kMaxDescriptors);
  appearance.descriptor = medoid(std::span(descriptors).last(num_used));
  return appearance;
}

}  // namespace waymark

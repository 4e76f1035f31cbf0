// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/appearance.h"

#include <array>
#include <bit>
#include <vector>

namespace waymark {
namespace {

/// Of each bit what most descriptors have (Grana et al. 2013); of as many, the newest's.
Descriptor majority(const std::vector<const Descriptor*>& descriptors) {
  Descriptor result = *descriptors.back();
  if (descriptors.size() < 3) return result;
  for (std::size_t word = 0; word < result.size(); ++word) {
    std::array<std::uint16_t, 64> counts{};
    for (const Descriptor* descriptor : descriptors) {
      for (std::uint64_t bits = (*descriptor)[word]; bits != 0; bits &= bits - 1) {
        ++counts[static_cast<std::size_t>(std::countr_zero(bits))];
      }
    }
    for (std::size_t bit = 0; bit < counts.size(); ++bit) {
      const std::uint64_t mask = std::uint64_t{1} << bit;
      if (2 * counts[bit] > descriptors.size()) result[word] |= mask;
      if (2 * counts[bit] < descriptors.size()) result[word] &= ~mask;
    }
  }
  return result;
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
  appearance.descriptor = majority(descriptors);
  appearance.direction.normalize();
  return appearance;
}

}  // namespace waymark

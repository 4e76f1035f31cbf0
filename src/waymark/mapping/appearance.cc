// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/appearance.h"

#include <array>
#include <cmath>
#include <span>

#include "waymark/base/median.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/hamming.h"

namespace waymark {
namespace {

/// More descriptors than this do not change the middle one by much; the newest are taken.
constexpr std::size_t kMaxDescriptors = 10;

Descriptor middle_descriptor(const std::vector<const Descriptor*>& descriptors) {
  std::array<std::array<int, kMaxDescriptors>, kMaxDescriptors> distances{};
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      distances[i][k] = distances[k][i] = hamming_distance(*descriptors[i], *descriptors[k]);
    }
  }
  std::size_t best = 0;
  int best_median = INT32_MAX;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const int middle = median(std::span(distances[i]).first(descriptors.size()));
    if (middle < best_median) {
      best_median = middle;
      best = i;
    }
  }
  return *descriptors[best];
}

/// The unit vector across an edge as camera 0 sees it, in the world; zero where there is none.
Eigen::Vector3d across_edge(const Features& features,
                            std::uint32_t feature,
                            const Rigid3& cam_from_world) {
  if (!features.is_edge(feature)) return Eigen::Vector3d::Zero();
  return cam_from_world.rotation_matrix().transpose() * edge_normal_in_cam(features, feature);
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
    const Rigid3 cam_from_world = keyframe.rig().cameras[0].cam_from_rig * keyframe.rig_from_world;
    const Eigen::Vector3d to_camera =
        cam_from_world.origin_in_source() - landmark.position_in_world;
    const double distance = to_camera.norm();
    appearance.direction += to_camera / distance;
    descriptors.push_back(&features.descriptors[observation.feature]);
    if (observation.keyframe == landmark.reference || appearance.size_m == 0.0) {
      appearance.size_m = distance * features.size_rad[observation.feature];
      appearance.across = across_edge(features, observation.feature, cam_from_world);
    }
  }
  if (descriptors.empty()) return landmark.appearance;
  if (descriptors.size() > kMaxDescriptors) {
    descriptors.erase(descriptors.begin(),
                      descriptors.end() - static_cast<std::ptrdiff_t>(kMaxDescriptors));
  }
  appearance.direction.normalize();
  appearance.descriptor = middle_descriptor(descriptors);
  return appearance;
}

}  // namespace waymark

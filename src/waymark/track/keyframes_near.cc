// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframes_near.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

namespace waymark {
namespace {

/// Of so many nearest keyframes, those that see what the rig should see are wanted.
constexpr std::size_t kNumNearest = 40;
/// What was seen from elsewhere does not look alike from here (Mur-Artal et al. 2015, V.D).
constexpr double kMinDirectionCos = 0.5;

std::vector<KeyframeId> nearest(const Map& map, SubmapId submap, const Eigen::Vector3d& centre) {
  std::vector<std::pair<double, KeyframeId>> distances;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    distances.emplace_back((keyframe.rig_from_world.origin_in_source() - centre).norm(), id);
  });
  std::ranges::sort(distances);
  if (distances.size() > kNumNearest) distances.resize(kNumNearest);
  std::vector<KeyframeId> ids;
  for (const auto& [distance, id] : distances) ids.push_back(id);
  return ids;
}

/// How many landmarks of a keyframe face the camera and lie within its image.
std::size_t count_visible(const Map& map,
                          const Keyframe& keyframe,
                          const Camera& camera,
                          const Rigid3& cam_from_world) {
  const Eigen::Vector3d centre = cam_from_world.origin_in_source();
  std::vector<Eigen::Vector3d> points_in_cam;
  for (std::size_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (!keyframe.landmarks[i].is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(keyframe.landmarks[i]);
    const Eigen::Vector3d to_camera = centre - landmark.position_in_world;
    if (to_camera.dot(landmark.appearance.direction) < kMinDirectionCos * to_camera.norm()) {
      continue;
    }
    points_in_cam.push_back(cam_from_world * landmark.position_in_world);
  }
  std::vector<Eigen::Vector2d> pixels(points_in_cam.size());
  std::vector<std::uint8_t> is_visible(points_in_cam.size());
  camera.project(points_in_cam, pixels, is_visible);
  return static_cast<std::size_t>(std::ranges::count(is_visible, std::uint8_t{1}));
}

}  // namespace

std::vector<KeyframeId> keyframes_near(const Map& map,
                                       SubmapId submap,
                                       const Rig& rig,
                                       const Rigid3& rig_from_world,
                                       std::size_t max_count) {
  const RigCamera& camera = rig.cameras.at(0);
  const Rigid3 cam_from_world = camera.cam_from_rig * rig_from_world;
  std::vector<std::pair<std::size_t, KeyframeId>> ranked;
  for (const KeyframeId id : nearest(map, submap, rig_from_world.origin_in_source())) {
    const std::size_t num_visible =
        count_visible(map, map.keyframes().at(id), *camera.camera, cam_from_world);
    if (num_visible > 0) ranked.emplace_back(num_visible, id);
  }
  std::ranges::stable_sort(ranked, std::greater(), &std::pair<std::size_t, KeyframeId>::first);
  if (ranked.size() > max_count) ranked.resize(max_count);
  std::vector<KeyframeId> ids;
  for (const auto& [num_visible, id] : ranked) ids.push_back(id);
  return ids;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_confidence.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace waymark {
namespace {

/// As in guided matching: what was seen from elsewhere does not look alike from here.
constexpr double kMinDirectionCos = 0.5;
/// The image is judged in so many columns and rows; regions with fewer landmarks say nothing.
constexpr int kRegions = 4;
constexpr int kMinExpected = 4;
/// A region with a smaller part found is not explained.
constexpr double kMinRegionRatio = 0.15;

struct Expected {
  std::vector<LandmarkId> ids;
  std::vector<Eigen::Vector3d> points_in_cam;
};

/// The landmarks of a keyframe that face the camera and have a size that its features can have.
Expected facing_landmarks(const Keyframe& keyframe,
                          const Features& features,
                          const Map& map,
                          const Rigid3& cam_from_world) {
  Expected expected;
  if (features.num_primary == 0) return expected;
  const auto end = features.size_rad.begin() + static_cast<std::ptrdiff_t>(features.num_primary);
  const auto [finest, coarsest] = std::minmax_element(features.size_rad.begin(), end);
  const Eigen::Vector3d centre = cam_from_world.origin_in_source();
  for (std::size_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (!keyframe.landmarks[i].is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(keyframe.landmarks[i]);
    const Eigen::Vector3d to_camera = centre - landmark.position_in_world;
    const double range_m = to_camera.norm();
    const double size_rad = landmark.appearance.size_m / range_m;
    if (!(size_rad >= *finest && size_rad <= *coarsest)) continue;
    if (to_camera.dot(landmark.appearance.direction) < kMinDirectionCos * range_m) continue;
    expected.ids.push_back(keyframe.landmarks[i]);
    expected.points_in_cam.push_back(cam_from_world * landmark.position_in_world);
  }
  return expected;
}

std::vector<LandmarkId> ascending(std::span<const LandmarkId> landmarks) {
  std::vector<LandmarkId> sorted;
  for (const LandmarkId id : landmarks) {
    if (id.is_valid()) sorted.push_back(id);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

std::size_t region_of(const Eigen::Vector2d& pixel, const Camera& camera) {
  const auto part = [](double at, int size) {
    return std::clamp(static_cast<int>(at * kRegions / size), 0, kRegions - 1);
  };
  return static_cast<std::size_t>(part(pixel.x(), camera.width_px()) * kRegions +
                                  part(pixel.y(), camera.height_px()));
}

}  // namespace

double place_confidence(const Rig& rig,
                        const Features& features,
                        std::span<const LandmarkId> landmarks,
                        const Map& map,
                        KeyframeId nearby,
                        const Rigid3& rig_from_world) {
  struct Region {
    int num_expected = 0;
    int num_found = 0;
  };
  const Camera& camera = *rig.cameras[0].camera;
  const Expected expected = facing_landmarks(
      map.keyframes().at(nearby), features, map, rig.cameras[0].cam_from_rig * rig_from_world);
  std::vector<Eigen::Vector2d> pixels(expected.ids.size());
  std::vector<std::uint8_t> is_visible(expected.ids.size());
  camera.project(expected.points_in_cam, pixels, is_visible);
  const std::vector<LandmarkId> found = ascending(landmarks);
  std::array<Region, kRegions * kRegions> regions;
  for (std::size_t i = 0; i < expected.ids.size(); ++i) {
    if (!is_visible[i]) continue;
    Region& region = regions[region_of(pixels[i], camera)];
    ++region.num_expected;
    region.num_found += std::binary_search(found.begin(), found.end(), expected.ids[i]);
  }
  int num_expected = 0;
  int num_found = 0;
  int num_explained = 0;
  for (const Region& region : regions) {
    if (region.num_expected < kMinExpected) continue;
    num_expected += region.num_expected;
    num_found += region.num_found;
    if (region.num_found > kMinRegionRatio * region.num_expected) {
      num_explained += region.num_expected;
    }
  }
  if (num_expected == 0) return 0.0;
  return (static_cast<double>(num_found) / num_expected) *
         (static_cast<double>(num_explained) / num_expected);
}

}  // namespace waymark

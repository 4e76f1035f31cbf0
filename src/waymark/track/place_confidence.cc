// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_confidence.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace waymark {
namespace {

/// As in guided matching: what was seen from elsewhere does not look alike from here (Mur-Artal et
/// al. 2015, V.D).
constexpr double kMinSameViewCos = 0.5;
/// The image is judged in so many columns and rows; regions with fewer landmarks say nothing.
constexpr int kRegions = 4;
constexpr int kMinExpected = 4;
/// And so many smaller cells, to tell where the keyframe shows something.
constexpr int kCells = 16;
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
  if (features.num_corners() == 0) return expected;
  const auto end = features.size_rad.begin() + static_cast<std::ptrdiff_t>(features.num_corners());
  const auto [finest, coarsest] = std::minmax_element(features.size_rad.begin(), end);
  const Eigen::Vector3d centre = cam_from_world.origin_in_source();
  for (std::size_t i = 0; i < keyframe.features->num_corners(); ++i) {
    if (!keyframe.landmarks[i].is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(keyframe.landmarks[i]);
    const Eigen::Vector3d to_camera = centre - landmark.position_in_world;
    const double range_m = to_camera.norm();
    const double size_rad = landmark.appearance.size_m / range_m;
    if (!(size_rad >= *finest && size_rad <= *coarsest)) continue;
    if (to_camera.dot(landmark.appearance.direction) < kMinSameViewCos * range_m) continue;
    expected.ids.push_back(keyframe.landmarks[i]);
    expected.points_in_cam.push_back(cam_from_world * landmark.position_in_world);
  }
  return expected;
}

/// Which of parts x parts rectangles of the image a pixel lies in.
std::size_t part_of(const Eigen::Vector2d& pixel, const Camera& camera, int parts) {
  const auto index = [parts](double at, int size) {
    return std::clamp(static_cast<int>(at * parts / size), 0, parts - 1);
  };
  return static_cast<std::size_t>(index(pixel.x(), camera.width_px()) * parts +
                                  index(pixel.y(), camera.height_px()));
}

struct Region {
  int num_expected = 0;
  int num_features = 0;  ///< In cells where something is expected.
  int num_found = 0;

  /// No more can be found than there are features, of which a camera that sees far more than the
  /// keyframe's has few there.
  int num_possible() const { return std::min(num_expected, num_features); }
};

using Regions = std::array<Region, kRegions * kRegions>;

void count_features(const Features& features,
                    const std::vector<std::uint8_t>& is_cell_expected,
                    const Camera& camera,
                    Regions& regions) {
  for (std::size_t i = 0; i < features.num_corners(); ++i) {
    const Eigen::Vector2d pixel(features.keypoints[i].x_px, features.keypoints[i].y_px);
    if (!is_cell_expected[part_of(pixel, camera, kCells)]) continue;
    ++regions[part_of(pixel, camera, kRegions)].num_features;
  }
}

/// The part found, times the part that lies in regions that are explained.
double judge(const Regions& regions) {
  int num_possible = 0;
  int num_found = 0;
  int num_explained = 0;
  for (const Region& region : regions) {
    if (region.num_expected < kMinExpected) continue;
    num_possible += region.num_possible();
    num_found += region.num_found;
    if (region.num_found > kMinRegionRatio * region.num_possible()) {
      num_explained += region.num_possible();
    }
  }
  if (num_possible == 0) return 0.0;
  const double found = std::min(1.0, static_cast<double>(num_found) / num_possible);
  return found * (static_cast<double>(num_explained) / num_possible);
}

}  // namespace

double place_confidence(const Features& features,
                        std::span<const LandmarkId> landmarks,
                        const Map& map,
                        KeyframeId nearby,
                        const Rigid3& rig_from_world) {
  const Camera& camera = *features.rig->cameras[0].camera;
  const Expected expected =
      facing_landmarks(map.keyframes().at(nearby),
                       features,
                       map,
                       features.rig->cameras[0].cam_from_rig * rig_from_world);
  std::vector<Eigen::Vector2d> pixels(expected.ids.size());
  std::vector<std::uint8_t> is_visible(expected.ids.size());
  camera.project(expected.points_in_cam, pixels, is_visible);
  std::vector<LandmarkId> found(landmarks.begin(), landmarks.end());
  std::ranges::sort(found);
  Regions regions;
  std::vector<std::uint8_t> is_cell_expected(kCells * kCells);
  for (std::size_t i = 0; i < expected.ids.size(); ++i) {
    if (!is_visible[i]) continue;
    is_cell_expected[part_of(pixels[i], camera, kCells)] = 1;
    Region& region = regions[part_of(pixels[i], camera, kRegions)];
    ++region.num_expected;
    region.num_found += std::ranges::binary_search(found, expected.ids[i]);
  }
  count_features(features, is_cell_expected, camera, regions);
  return judge(regions);
}

}  // namespace waymark

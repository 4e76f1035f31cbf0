// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/triangulate.h"

#include <algorithm>

#include "waymark/camera/pixel_angles.h"
#include "waymark/geometry/triangulation.h"

namespace waymark {
namespace {

/// From the ninth partner on, each adds less than a twentieth of what those before it gave
/// (docs/decisions.md).
constexpr std::size_t kMaxPartners = 8;

/// The matcher has asked for enough parallax in pixels; this only guards the division.
constexpr double kMinParallaxRad = 1e-3;

std::vector<std::uint8_t> taken_features(const Keyframe& keyframe) {
  std::vector<std::uint8_t> is_taken(keyframe.features->num_primary);
  for (std::size_t i = 0; i < is_taken.size(); ++i) is_taken[i] = keyframe.landmarks[i].is_valid();
  return is_taken;
}

/// Distance from a keyframe within which the nearest tenth of the landmarks that it sees lie.
double near_distance(const Map& map, const Keyframe& keyframe) {
  const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
  std::vector<double> distances;
  for (std::size_t i = 0; i < keyframe.features->num_primary; ++i) {
    const Landmark* landmark = map.landmarks().find(keyframe.landmarks[i]);
    if (landmark) distances.push_back((landmark->position_in_world - centre).norm());
  }
  if (distances.empty()) return 0.0;
  const auto tenth = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 10);
  std::nth_element(distances.begin(), tenth, distances.end());
  return *tenth;
}

/// Covisible keyframes that tell depths, those that share most first: the nearest tenth of what the
/// keyframe sees has at least the parallax that the matcher asks for. With one pixel of noise in
/// either view, depths are then known to sqrt(2) / 4 or better. Closer ones would be searched in
/// vain.
std::vector<KeyframeId> choose_partners(const Map& map, KeyframeId id, double min_parallax_px) {
  const Keyframe& keyframe = map.keyframes().at(id);
  const double pixel_rad = central_pixel_angle(*keyframe.rig->cameras[0].camera);
  const double min_baseline = min_parallax_px * pixel_rad * near_distance(map, keyframe);
  const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
  std::vector<KeyframeId> partners = strongest_neighbours(map, id, map.covisible(id).size());
  std::erase_if(partners, [&](KeyframeId other) {
    const Rigid3& rig_from_world = map.keyframes().at(other).rig_from_world;
    const double baseline = (rig_from_world.origin_in_source() - centre).norm();
    return baseline == 0.0 || baseline < min_baseline;
  });
  if (partners.size() > kMaxPartners) partners.resize(kMaxPartners);
  return partners;
}

std::optional<Eigen::Vector3d> triangulate_match(const Keyframe& a,
                                                 const Keyframe& b,
                                                 const Rigid3& b_from_a,
                                                 const FeatureMatch& match) {
  const auto point_in_a = triangulate(a.features->bearings[match.a].cast<double>(),
                                      b.features->bearings[match.b].cast<double>(),
                                      b_from_a.inverse(),
                                      kMinParallaxRad);
  if (!point_in_a) return std::nullopt;
  const Rigid3 world_from_a = (a.rig->cameras[0].cam_from_rig * a.rig_from_world).inverse();
  const Eigen::Vector3d point = world_from_a * *point_in_a;
  if (!point.allFinite() || !agrees(a, match.a, point) || !agrees(b, match.b, point)) {
    return std::nullopt;
  }
  return point;
}

}  // namespace

std::vector<LandmarkId> triangulate_with_neighbours(Map& map,
                                                    KeyframeId id,
                                                    EpipolarMatcher& matcher,
                                                    DirtyLandmarks& dirty) {
  std::vector<LandmarkId> added;
  const EpipolarOptions options;
  for (KeyframeId neighbour : choose_partners(map, id, options.min_parallax_px)) {
    const Keyframe a = map.keyframes().at(id);
    const Keyframe b = map.keyframes().at(neighbour);
    const Rigid3 b_from_a = (b.rig->cameras[0].cam_from_rig * b.rig_from_world) *
                            (a.rig->cameras[0].cam_from_rig * a.rig_from_world).inverse();
    const auto matches = matcher.match(
        *a.features, taken_features(a), *b.features, taken_features(b), b_from_a, options);
    for (const FeatureMatch& match : matches) {
      const auto point = triangulate_match(a, b, b_from_a, match);
      if (!point) continue;
      const LandmarkId landmark = map.add_landmark(a.submap, *point, id);
      observe_with_partner(map, id, match.a, landmark);
      observe_with_partner(map, neighbour, match.b, landmark);
      dirty.insert(landmark);
      added.push_back(landmark);
    }
  }
  return added;
}

}  // namespace waymark

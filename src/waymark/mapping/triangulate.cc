// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/triangulate.h"

#include "waymark/base/median.h"
#include "waymark/geometry/triangulation.h"

namespace waymark {
namespace {

std::vector<std::uint8_t> taken_features(const Keyframe& keyframe) {
  std::vector<std::uint8_t> is_taken(keyframe.features->num_primary);
  for (std::size_t i = 0; i < is_taken.size(); ++i) is_taken[i] = keyframe.landmarks[i].is_valid();
  return is_taken;
}

/// Median distance from a keyframe to the landmarks it sees.
double median_distance(const Map& map, const Keyframe& keyframe) {
  const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
  std::vector<double> distances;
  for (std::size_t i = 0; i < keyframe.features->num_primary; ++i) {
    const Landmark* landmark = map.landmarks().find(keyframe.landmarks[i]);
    if (landmark) distances.push_back((landmark->position_in_world - centre).norm());
  }
  return distances.empty() ? 0.0 : median(distances);
}

std::optional<Eigen::Vector3d> triangulate_match(const Keyframe& a,
                                                 const Keyframe& b,
                                                 const Rigid3& b_from_a,
                                                 const FeatureMatch& match,
                                                 double min_parallax_rad) {
  const auto point_in_a = triangulate(a.features->bearings[match.a].cast<double>(),
                                      b.features->bearings[match.b].cast<double>(),
                                      b_from_a.inverse(),
                                      min_parallax_rad);
  if (!point_in_a) return std::nullopt;
  const Rigid3 world_from_a = (a.rig().cameras[0].cam_from_rig * a.rig_from_world).inverse();
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
                                                    DirtyLandmarks& dirty,
                                                    const TriangulationOptions& options) {
  std::vector<LandmarkId> added;
  const double distance = median_distance(map, map.keyframes().at(id));
  for (KeyframeId neighbour :
       strongest_neighbours(map, id, static_cast<std::size_t>(options.max_neighbours))) {
    const Keyframe a = map.keyframes().at(id);
    const Keyframe b = map.keyframes().at(neighbour);
    const Rigid3 b_from_a = (b.rig().cameras[0].cam_from_rig * b.rig_from_world) *
                            (a.rig().cameras[0].cam_from_rig * a.rig_from_world).inverse();
    if (b_from_a.translation.norm() < options.min_baseline_ratio * distance) continue;
    const auto matches = matcher.match(*a.features,
                                       taken_features(a),
                                       *b.features,
                                       taken_features(b),
                                       b_from_a,
                                       EpipolarOptions{});
    for (const FeatureMatch& match : matches) {
      const auto point = triangulate_match(a, b, b_from_a, match, options.min_parallax_rad);
      if (!point) continue;
      const LandmarkId landmark = map.add_landmark(a.submap, *point, id);
      map.observe(id, match.a, landmark);
      map.observe(neighbour, match.b, landmark);
      dirty.insert(landmark);
      added.push_back(landmark);
    }
  }
  return added;
}

}  // namespace waymark

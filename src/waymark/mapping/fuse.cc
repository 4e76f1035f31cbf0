// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/fuse.h"

#include <Eigen/LU>
#include <algorithm>

#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

/// Covisible keyframes in which a keyframe's landmarks are looked for: those that share most, which
/// give three quarters or more of what twice as many would (docs/decisions.md).
constexpr std::size_t kMaxTargets = 20;

/// At this distance pairs that show the same are still several times as frequent as those that do
/// not (docs/decisions.md). Of the features in reach the most alike is tested, whatever the second.
constexpr AppearanceOptions kAppearance{.max_distance = 50, .max_ratio = 1.0};

/// In pixels of the landmark's expected level (docs/decisions.md).
constexpr double kRadiusPx = 3.0;

/// What its observations tell of the position of a landmark, as the inverse of a covariance (1/m^2,
/// world axes), the keyframes taken as known.
Eigen::Matrix3d position_information(const Map& map, LandmarkId id) {
  const Landmark& landmark = map.landmarks().at(id);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Measurement measured = keyframe.features->measurement(observation.feature);
    const Rigid3 cam_from_world =
        keyframe.rig->cameras[measured.camera].cam_from_rig * keyframe.rig_from_world;
    const Eigen::Matrix3d rotation = cam_from_world.rotation_matrix();
    const InverseRangePoint seen = in_inverse_range(cam_from_world * landmark.position_in_world);
    const Matrix23d across =
        bearing_residual_by_point(seen, measured.level_pixel_from_bearing) * rotation;
    information += across.transpose() * across;
    if (measured.inverse_range_sigma <= 0.0) continue;
    const Eigen::RowVector3d along =
        range_residual_by_point(seen, measured.inverse_range_sigma) * rotation;
    information += along.transpose() * along;
  }
  return information;
}

/// Landmarks that source sees and target does not.
LandmarkSet seen_only_by(const Map& map, std::span<const KeyframeId> sources, KeyframeId target) {
  std::vector<LandmarkId> seen;
  for (KeyframeId source : sources) {
    const auto& landmarks = map.keyframes().at(source).landmarks;
    seen.insert(seen.end(), landmarks.begin(), landmarks.end());
  }
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  std::vector<LandmarkId> known = map.keyframes().at(target).landmarks;
  std::sort(known.begin(), known.end());
  LandmarkSet set;
  for (LandmarkId id : seen) {
    if (!id.is_valid() || std::binary_search(known.begin(), known.end(), id)) continue;
    const Landmark& landmark = map.landmarks().at(id);
    if (landmark.appearance.size_m > 0.0) set.add(id, landmark);
  }
  return set;
}

}  // namespace

void merge(Map& map, LandmarkId a, LandmarkId b, DirtyLandmarks& dirty) {
  const bool keeps_a =
      position_information(map, a).determinant() >= position_information(map, b).determinant();
  const LandmarkId survivor = keeps_a ? a : b;
  const LandmarkId absorbed = keeps_a ? b : a;
  map.merge_landmarks(survivor, absorbed);
  dirty.erase(absorbed);
  dirty.insert(survivor);
}

void fuse_into(Map& map,
               std::span<const KeyframeId> sources,
               KeyframeId target,
               ProjectionMatcher& matcher,
               DirtyLandmarks& dirty) {
  const LandmarkSet landmarks = seen_only_by(map, sources, target);
  const std::shared_ptr<const Features> features = map.keyframes().at(target).features;
  matcher.look_with(map.keyframes().at(target).rig);
  const ProjectionMatches& matches =
      matcher.match(landmarks,
                    *features,
                    {},
                    map.keyframes().at(target).rig_from_world,
                    {.radius_px = kRadiusPx, .appearance = kAppearance});
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const std::uint32_t feature = matches.features[i];
    const LandmarkId id = landmarks.ids[i];
    if (feature == kNoFeature || !map.landmarks().find(id)) continue;
    const Landmark& landmark = map.landmarks().at(id);
    const Keyframe& keyframe = map.keyframes().at(target);
    if (!agrees(keyframe, feature, landmark.position_in_world)) continue;
    const LandmarkId present = keyframe.landmarks[feature];
    if (!present.is_valid()) {
      observe_with_partner(map, target, feature, id);
      dirty.insert(id);
      continue;
    }
    merge(map, present, id, dirty);
  }
}

void fuse_with_neighbours(Map& map,
                          KeyframeId keyframe,
                          ProjectionMatcher& matcher,
                          DirtyLandmarks& dirty) {
  const std::vector<KeyframeId> targets = strongest_neighbours(map, keyframe, kMaxTargets);
  for (KeyframeId target : targets) {
    fuse_into(map, std::span(&keyframe, 1), target, matcher, dirty);
  }
  fuse_into(map, targets, keyframe, matcher, dirty);
}

}  // namespace waymark

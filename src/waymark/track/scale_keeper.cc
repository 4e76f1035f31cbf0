// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/scale_keeper.h"

#include <algorithm>
#include <cmath>

#include "waymark/base/median.h"
#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

/// So many landmarks agree on a similarity by chance hardly ever: each has two images to agree in.
constexpr std::size_t kMinSimilar = 6;
constexpr AppearanceOptions kSimilarAppearance{.max_distance = 64, .max_ratio = 0.85};
/// Of landmarks that were mapped independently, one side from two views near each other: twice as
/// much as where loops are closed (docs/decisions.md).
constexpr double kSimilarNoisePx = 3.0;

/// The speed before is that of so many steps from keyframe to keyframe, in the median.
constexpr std::size_t kNumSpeedSteps = 3;
/// Who moved less, as a part of the distance of what is seen, may as well have stood still.
constexpr double kLeastMotion = 0.01;
/// Scales of parts that begin 1.5 s after the one before ends, as their speeds tell them, by the
/// true ones (docs/decisions.md).
constexpr double kSpeedLogSigma = 0.24;

struct KeyframeStep {
  double length = 0.0;
  double seconds = 0.0;
};

template <class Posed>
KeyframeStep step_between(const Posed& one, const Posed& other) {
  const Eigen::Vector3d moved =
      other.rig_from_world.origin_in_source() - one.rig_from_world.origin_in_source();
  return {moved.norm(), 1e-9 * static_cast<double>(other.timestamp_ns - one.timestamp_ns)};
}

/// The newest one of the same sub-map that is older; invalid where there is none.
KeyframeId keyframe_before(const Map& map, KeyframeId id) {
  const SubmapId submap = map.keyframes().at(id).submap;
  while (id.value-- > 0) {
    const Keyframe* const keyframe = map.keyframes().find(id);
    if (keyframe && keyframe->submap == submap) return id;
  }
  return {};
}

std::vector<std::uint32_t> features_with_landmark(const Keyframe& keyframe) {
  std::vector<std::uint32_t> with_landmark;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) with_landmark.push_back(i);
  }
  return with_landmark;
}

}  // namespace

LandmarkMatches ScaleKeeper::match(const Map& map,
                                   const Keyframe& before,
                                   const NewSubmap& start,
                                   std::size_t index) {
  const InitialKeyframe& after = start.keyframes[index];
  std::vector<const InitialLandmark*> shown(after.features->size());
  for (const InitialLandmark& landmark : start.landmarks) {
    const std::uint32_t feature = landmark.features[index];
    if (feature != kNoFeature) shown[feature] = &landmark;
  }
  const Rigid3 before_cam_from_world = before.rig->cameras[0].cam_from_rig * before.rig_from_world;
  const Rigid3 after_cam_from_world = start.rig->cameras[0].cam_from_rig * after.rig_from_world;
  LandmarkMatches matches;
  for (const FeatureMatch& pair : appearance_.match_all(
           *before.features, features_with_landmark(before), *after.features, kSimilarAppearance)) {
    const InitialLandmark* const landmark = shown[pair.b];
    if (!landmark) continue;
    const Landmark& known = map.landmarks().at(before.landmarks[pair.a]);
    matches.a.add(after_cam_from_world * landmark->position_in_world,
                  after.features->measurement(pair.b));
    matches.b.add(before_cam_from_world * known.position_in_world,
                  before.features->measurement(pair.a));
  }
  return matches;
}

std::optional<KeptScale> ScaleKeeper::by_landmarks(const Map& map,
                                                   std::span<const KeyframeId> keyframes,
                                                   const NewSubmap& start) {
  std::optional<KeptScale> best;
  for (const KeyframeId id : keyframes) {
    for (std::size_t k = 0; k < start.keyframes.size(); ++k) {
      const LandmarkMatches matches = match(map, map.keyframes().at(id), start, k);
      const auto found = find_similarity(
          matches,
          {.is_scale_free = true, .noise_px = kSimilarNoisePx},
          {.seed = seed_, .stream = start.keyframes[k].frame.value, .min_inlier_ratio = 0.15});
      if (!found || found->num_inliers < kMinSimilar) continue;
      if (best && best->num_landmarks >= found->num_inliers) continue;
      const double log_sigma = std::sqrt(found->covariance(6, 6));
      if (!(log_sigma < kSpeedLogSigma)) continue;
      best = {{}, {}, found->b_from_a.scale, log_sigma, found->num_inliers};
    }
  }
  return best;
}

std::optional<KeptScale> scale_by_speed(const Map& map, KeyframeId last, const NewSubmap& start) {
  if (start.keyframes.size() < 2) return std::nullopt;
  std::vector<double> speeds;
  double in_distances = 0.0;  // How far it went, as a part of the distance of what it saw.
  KeyframeId id = last;
  while (speeds.size() < kNumSpeedSteps) {
    const KeyframeId before = keyframe_before(map, id);
    if (!before.is_valid()) break;
    const Keyframe& keyframe = map.keyframes().at(id);
    const KeyframeStep step = step_between(map.keyframes().at(before), keyframe);
    if (!(step.seconds > 0.0)) break;
    speeds.push_back(step.length / step.seconds);
    in_distances +=
        step.length * median_inverse_range(map, keyframe.rig_from_world, keyframe.landmarks);
    id = before;
  }
  const KeyframeStep after = step_between(start.keyframes.front(), start.keyframes.back());
  if (in_distances < kLeastMotion || !(after.length > 0.0)) return std::nullopt;
  const double speed_after = after.length / after.seconds;
  return KeptScale{{}, {}, median(speeds) / speed_after, kSpeedLogSigma, 0};
}

void scale_by(double factor, Initialization& start) {
  start.rig_from_world.translation *= factor;
  for (InitialKeyframe& keyframe : start.submap.keyframes) {
    keyframe.rig_from_world.translation *= factor;
  }
  for (InitialLandmark& landmark : start.submap.landmarks) landmark.position_in_world *= factor;
  for (FilledPose& filled : start.filled) filled.pose.rig_from_reference.translation *= factor;
}

void ScaleKeeper::keep(const Map& map,
                       std::span<const KeyframeId> keyframes,
                       Initialization& start) {
  if (keyframes.empty()) return;
  const KeyframeId last = *std::ranges::max_element(keyframes);
  std::optional<KeptScale> kept = by_landmarks(map, keyframes, start.submap);
  if (!kept) kept = scale_by_speed(map, last, start.submap);
  if (!kept) return;
  scale_by(kept->scale, start);
  kept->submap = SubmapId{static_cast<std::uint32_t>(map.submaps().size())};
  kept->before = map.keyframes().at(last).submap;
  kept_.push_back(*kept);
}

std::vector<KeptScale> ScaleKeeper::kept_in(const Map& map) const {
  std::vector<KeptScale> found;
  for (KeptScale kept : kept_) {
    if (kept.submap.value >= map.submaps().size()) continue;
    kept.submap = map.resolve(kept.submap);
    kept.before = map.resolve(kept.before);
    const bool is_metric = map.submaps()[kept.submap.value].is_metric;
    if (kept.submap != kept.before && !is_metric) found.push_back(kept);
  }
  return found;
}

}  // namespace waymark

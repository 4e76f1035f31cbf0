// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/fuse.h"

#include <algorithm>

namespace waymark {
namespace {

/// Neighbours of a keyframe and the strongest of theirs, without itself, ascending.
std::vector<KeyframeId> surroundings(const Map& map, KeyframeId id, const FuseOptions& options) {
  std::vector<KeyframeId> ids =
      strongest_neighbours(map, id, static_cast<std::size_t>(options.max_neighbours));
  const std::vector<KeyframeId> first = ids;
  for (KeyframeId neighbour : first) {
    const auto second = strongest_neighbours(
        map, neighbour, static_cast<std::size_t>(options.max_second_neighbours));
    ids.insert(ids.end(), second.begin(), second.end());
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::erase(ids, id);
  return ids;
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
  const bool keeps_a = num_observers(map.landmarks().at(a)) >= num_observers(map.landmarks().at(b));
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
  const ProjectionMatches& matches = matcher.match(*features->rig,
                                                   landmarks,
                                                   *features,
                                                   {},
                                                   map.keyframes().at(target).rig_from_world,
                                                   {.radius_px = 3.0, .appearance = {50, 1.0}});
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const std::uint32_t feature = matches.features[i];
    const LandmarkId id = landmarks.ids[i];
    if (feature == kNoFeature || !map.landmarks().find(id)) continue;
    const Landmark& landmark = map.landmarks().at(id);
    const Keyframe& keyframe = map.keyframes().at(target);
    if (!agrees(keyframe, feature, landmark.position_in_world)) continue;
    const LandmarkId present = keyframe.landmarks[feature];
    if (!present.is_valid()) {
      map.observe(target, feature, id);
      dirty.insert(id);
      continue;
    }
    merge(map, present, id, dirty);
  }
}

void fuse_with_neighbours(Map& map,
                          KeyframeId keyframe,
                          ProjectionMatcher& matcher,
                          DirtyLandmarks& dirty,
                          const FuseOptions& options) {
  const std::vector<KeyframeId> targets = surroundings(map, keyframe, options);
  for (KeyframeId target : targets) {
    fuse_into(map, std::span(&keyframe, 1), target, matcher, dirty);
  }
  fuse_into(map, targets, keyframe, matcher, dirty);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/cull.h"

#include <algorithm>

#include "waymark/mapping/bundle_window.h"

namespace waymark {
namespace {

// Mur-Artal et al. 2015, VI.B: a landmark must pass a test during its first three keyframes. It has
// to be found in more than a quarter of the frames that should see it and, once another keyframe
// has passed, be seen from three; a range that was measured stands for one of them. The three
// newest keyframes are not judged while what they added is on probation.
constexpr std::size_t kProbationKeyframes = 3;
constexpr std::uint32_t kFramesPerFind = 4;
constexpr std::size_t kMinObservers = 3;

// Mur-Artal et al. 2015, VI.E: a keyframe is redundant when 90 % of what it sees is seen by at
// least three others at the same or a finer scale.
constexpr double kRedundantRatio = 0.9;
constexpr std::size_t kRedundantObservers = 3;
/// Scale is the size of a pixel on the landmark here, which distance changes, too. Half a pyramid
/// level is still the same: features of one point lie no closer.
constexpr double kSameScale = 1.1;

bool is_weak(const Map& map, const Landmark& landmark, std::size_t age) {
  if (landmark.num_found < landmark.num_visible / kFramesPerFind) return true;
  if (age < 2) return false;
  const bool is_metric = map.submaps()[landmark.submap.value].is_metric;
  return num_observers(landmark) + (is_metric ? 1 : 0) < kMinObservers;
}

/// Extent in map units of a pixel of the feature that sees a landmark, at the landmark.
double pixel_size(const Map& map, const Landmark& landmark, const Observation& observation) {
  const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
  return keyframe.features->size_rad[observation.feature] *
         (keyframe.rig_from_world * landmark.position_in_world).norm();
}

/// Whether enough keyframes other than that of an observation see its landmark as finely.
bool is_seen_as_well(const Map& map, const Landmark& landmark, const Observation& own) {
  const double max_size = kSameScale * pixel_size(map, landmark, own);
  std::size_t others = 0;
  KeyframeId last;
  for (const Observation& observation : landmark.observations) {
    if (observation.keyframe == own.keyframe || observation.keyframe == last) continue;
    last = observation.keyframe;
    others += pixel_size(map, landmark, observation) <= max_size;
  }
  return others >= kRedundantObservers;
}

bool is_redundant(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes().at(id);
  std::size_t num_landmarks = 0;
  std::size_t num_redundant = 0;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (!keyframe.landmarks[i].is_valid()) continue;
    ++num_landmarks;
    num_redundant += is_seen_as_well(map, map.landmarks().at(keyframe.landmarks[i]), {id, i});
  }
  return static_cast<double>(num_redundant) > kRedundantRatio * static_cast<double>(num_landmarks);
}

}  // namespace

void Probation::review(Map& map, std::size_t keyframe_count, DirtyLandmarks& dirty) {
  std::erase_if(entries_, [&](const Entry& entry) {
    const Landmark* landmark = map.landmarks().find(entry.landmark);
    if (!landmark) return true;
    const std::size_t age = keyframe_count - entry.added_at;
    if (is_weak(map, *landmark, age)) {
      map.erase_landmark(entry.landmark);
      dirty.erase(entry.landmark);
      return true;
    }
    return age >= kProbationKeyframes;
  });
}

std::vector<KeyframeId> cull_redundant_keyframes(Map& map,
                                                 KeyframeId centre,
                                                 DirtyLandmarks& dirty) {
  std::vector<KeyframeId> erased;
  const std::vector<CovisibilityEdge> edges = map.covisible(centre);
  for (const auto& [id, num_shared] : edges) {
    const Keyframe* keyframe = map.keyframes().find(id);
    // Roots are the origin of a world, and loop edges were measured between two views.
    if (!keyframe || !keyframe->parent.is_valid() || map.has_loop_edge(id)) continue;
    if (id.value + kProbationKeyframes > centre.value || !is_redundant(map, id)) continue;
    for (LandmarkId landmark : keyframe->landmarks) {
      if (landmark.is_valid()) dirty.insert(landmark);
    }
    map.erase_keyframe(id);
    erased.push_back(id);
  }
  std::erase_if(dirty, [&](LandmarkId id) { return !map.landmarks().contains(id); });
  return erased;
}

}  // namespace waymark

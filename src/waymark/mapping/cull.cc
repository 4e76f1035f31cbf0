// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/cull.h"

#include <algorithm>

#include "waymark/mapping/bundle_window.h"

namespace waymark {
namespace {

bool is_weak(const Map& map, const Landmark& landmark, std::size_t age, double min_found_ratio) {
  if (landmark.num_visible >= 4 &&
      landmark.num_found < min_found_ratio * static_cast<double>(landmark.num_visible)) {
    return true;
  }
  if (age < 2) return false;
  const bool is_metric = map.submaps()[landmark.submap.value].is_metric;
  return num_observers(landmark) < (is_metric ? 2u : 3u);
}

/// Whether enough other keyframes see a landmark from as near or nearer, judged by size.
std::size_t num_seeing_as_well(const Map& map,
                               const Landmark& landmark,
                               KeyframeId id,
                               float size_rad) {
  std::size_t others = 0;
  KeyframeId last;
  for (const Observation& observation : landmark.observations) {
    if (observation.keyframe == id || observation.keyframe == last) continue;
    last = observation.keyframe;
    const Features& features = *map.keyframes().at(observation.keyframe).features;
    others += features.size_rad[observation.feature] <= 1.3f * size_rad;
  }
  return others;
}

bool is_redundant(const Map& map, KeyframeId id, const CullingOptions& options) {
  const Keyframe& keyframe = map.keyframes().at(id);
  std::size_t num_landmarks = 0;
  std::size_t num_redundant = 0;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (!keyframe.landmarks[i].is_valid()) continue;
    ++num_landmarks;
    const Landmark& landmark = map.landmarks().at(keyframe.landmarks[i]);
    num_redundant += num_seeing_as_well(map, landmark, id, keyframe.features->size_rad[i]) >=
                     static_cast<std::size_t>(options.redundant_observers);
  }
  return static_cast<double>(num_redundant) >
         options.redundant_ratio * static_cast<double>(num_landmarks);
}

}  // namespace

void RecentLandmarks::review(Map& map,
                             std::size_t keyframe_count,
                             DirtyLandmarks& dirty,
                             const CullingOptions& options) {
  std::erase_if(entries_, [&](const Entry& entry) {
    const Landmark* landmark = map.landmarks().find(entry.landmark);
    if (!landmark) return true;
    const std::size_t age = keyframe_count - entry.added_at;
    if (is_weak(map, *landmark, age, options.min_found_ratio)) {
      map.erase_landmark(entry.landmark);
      dirty.erase(entry.landmark);
      return true;
    }
    return age >= static_cast<std::size_t>(options.recent_keyframes);
  });
}

std::vector<KeyframeId> cull_redundant_keyframes(Map& map,
                                                 KeyframeId centre,
                                                 DirtyLandmarks& dirty,
                                                 const CullingOptions& options) {
  std::vector<KeyframeId> erased;
  for (KeyframeId id : strongest_neighbours(map, centre, 30)) {
    const Keyframe* keyframe = map.keyframes().find(id);
    if (!keyframe || !keyframe->parent.is_valid() || map.has_loop_edge(id)) continue;
    if (id.value + static_cast<std::uint32_t>(options.num_newest) > centre.value ||
        !is_redundant(map, id, options))
      continue;
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

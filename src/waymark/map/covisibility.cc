// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/covisibility.h"

#include <algorithm>
#include <utility>

#include "waymark/map/map.h"

namespace waymark {

Covisibility CovisibilityCounter::count(KeyframeId id, const Keyframe& keyframe) {
  seen_.clear();
  for (const LandmarkId landmark : keyframe.landmarks) {
    if (landmark.is_valid()) seen_.push_back(landmark);
  }
  std::sort(seen_.begin(), seen_.end());
  seen_.erase(std::unique(seen_.begin(), seen_.end()), seen_.end());
  Covisibility result;
  for (const LandmarkId landmark_id : seen_) {
    const Landmark* landmark = landmarks_.find(landmark_id);
    if (!landmark) continue;
    KeyframeId last;
    for (const Observation& observation : landmark->observations) {
      const KeyframeId other = observation.keyframe;
      if (other == last || other == id || !keyframes_.contains(other)) continue;
      last = other;
      if (num_shared_[other.value]++ == 0) result.edges.push_back({other, 0});
    }
  }
  std::sort(
      result.edges.begin(),
      result.edges.end(),
      [](const CovisibilityEdge& a, const CovisibilityEdge& b) { return a.keyframe < b.keyframe; });
  for (CovisibilityEdge& edge : result.edges) {
    edge.num_shared = std::exchange(num_shared_[edge.keyframe.value], 0u);
  }
  return result;
}

std::vector<KeyframeId> strongest_neighbours(const Map& map,
                                             KeyframeId keyframe,
                                             std::size_t max_count) {
  std::vector<CovisibilityEdge> edges = map.covisible(keyframe);
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.num_shared != b.num_shared ? a.num_shared > b.num_shared : a.keyframe > b.keyframe;
  });
  if (edges.size() > max_count) edges.resize(max_count);
  std::vector<KeyframeId> ids;
  for (const CovisibilityEdge& edge : edges) ids.push_back(edge.keyframe);
  return ids;
}

std::vector<SubmapId> submaps_by_size(const Map& map) {
  std::vector<std::size_t> sizes(map.submaps().size(), 0);
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { ++sizes.at(keyframe.submap.value); });
  std::vector<SubmapId> submaps;
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i] > 0) submaps.push_back(SubmapId{i});
  }
  std::stable_sort(submaps.begin(), submaps.end(), [&](SubmapId a, SubmapId b) {
    return sizes[a.value] > sizes[b.value];
  });
  return submaps;
}

}  // namespace waymark

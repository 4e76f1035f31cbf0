// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <utility>

#include "waymark/map/map.h"

namespace waymark {

CopyOnWriteTable<KeyframeId, Covisibility> Map::count_covisibility() const {
  CopyOnWriteTable<KeyframeId, Covisibility> counted;
  std::vector<std::uint32_t> num_shared(keyframes_.end_id().value, 0);
  keyframes_.for_each([&](KeyframeId id, const Keyframe& keyframe) {
    std::vector<LandmarkId> seen = keyframe.landmarks;
    std::erase(seen, LandmarkId{});
    std::sort(seen.begin(), seen.end());
    seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
    std::vector<CovisibilityEdge> edges;
    for (const LandmarkId landmark_id : seen) {
      const Landmark* landmark = landmarks_.find(landmark_id);
      if (!landmark) continue;
      KeyframeId last;
      for (const Observation& observation : landmark->observations) {
        const KeyframeId other = observation.keyframe;
        if (other == last || other == id || !keyframes_.contains(other)) continue;
        last = other;
        if (num_shared[other.value]++ == 0) edges.push_back({other, 0});
      }
    }
    std::ranges::sort(edges, {}, &CovisibilityEdge::keyframe);
    for (CovisibilityEdge& edge : edges) {
      edge.num_shared = std::exchange(num_shared[edge.keyframe.value], 0u);
    }
    counted.skip_to(id);
    counted.insert({std::move(edges)});
  });
  counted.skip_to(keyframes_.end_id());
  return counted;
}

std::vector<KeyframeId> strongest_neighbours(const Map& map,
                                             KeyframeId keyframe,
                                             std::size_t max_count) {
  std::vector<CovisibilityEdge> edges = map.covisible(keyframe);
  std::ranges::sort(edges, std::greater(), [](const CovisibilityEdge& edge) {
    return std::pair(edge.num_shared, edge.keyframe);
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
  std::ranges::stable_sort(
      submaps, std::greater(), [&](SubmapId submap) { return sizes[submap.value]; });
  return submaps;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/find.h"

#include <algorithm>
#include <iterator>

namespace waymark {
namespace {

bool are_linked(const Map& map, KeyframeId a, KeyframeId b) {
  return std::ranges::any_of(map.covisible(a), [&](const CovisibilityEdge& edge) {
    return edge.keyframe == b && edge.num_shared >= kMinSharedOfLinked;
  });
}

/// Whether there are other sub-maps that this one might be joined with.
bool has_others(const Map& map, SubmapId own) {
  std::uint32_t id = 0;
  return std::ranges::any_of(map.submaps(), [&](const Submap& other) {
    return SubmapId{id++} != own && other.root.is_valid() &&
           other.is_metric == map.submaps()[own.value].is_metric;
  });
}

}  // namespace

bool has_metric_submap(const Map& map, KeyframeId keyframe) {
  return map.submaps()[map.keyframes().at(keyframe).submap.value].is_metric;
}

std::vector<KeyframeId> within_steps(const Map& map, KeyframeId keyframe, int num_steps) {
  std::vector<KeyframeId> near = {keyframe};
  std::vector<KeyframeId> front = near;
  for (int step = 0; step < num_steps; ++step) {
    std::vector<KeyframeId> next;
    for (KeyframeId id : front) {
      const KeyframeId parent = map.keyframes().at(id).parent;
      if (parent.is_valid()) next.push_back(parent);
      for (const CovisibilityEdge& edge : map.covisible(id)) {
        if (edge.num_shared >= kMinSharedOfLinked) next.push_back(edge.keyframe);
      }
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    front.clear();
    std::set_difference(
        next.begin(), next.end(), near.begin(), near.end(), std::back_inserter(front));
    near.insert(near.end(), front.begin(), front.end());
    std::sort(near.begin(), near.end());
  }
  return near;
}

std::vector<KeyframeId> with_neighbours(const Map& map,
                                        KeyframeId keyframe,
                                        std::size_t max_count) {
  std::vector<KeyframeId> ids = strongest_neighbours(map, keyframe, max_count);
  ids.insert(ids.begin(), keyframe);
  return ids;
}

std::vector<KeyframeId> find_alike(const Map& map,
                                   const PlaceIndex& places,
                                   KeyframeId query,
                                   const CandidateOptions& options) {
  const std::vector<KeyframeId> near = within_steps(map, query, options.num_near_steps);
  const SubmapId own = map.keyframes().at(query).submap;
  const auto ranked = places.find(
      map.keyframes().at(query).features->corner_descriptors(),
      {.max_candidates = has_others(map, own)
                             ? places.size()
                             : near.size() + static_cast<std::size_t>(options.num_ranked),
       .is_excluded = [&](const PlaceRow& row) { return row.keyframe == query; }});
  double best_near = 0.0;
  for (const PlaceCandidate& candidate : ranked) {
    if (std::ranges::binary_search(near, candidate.keyframe))
      best_near = std::max(best_near, candidate.score);
  }
  std::vector<KeyframeId> alike;
  std::size_t num_own = 0;
  std::size_t num_others = 0;
  for (const PlaceCandidate& candidate : ranked) {
    const KeyframeId id = candidate.keyframe;
    if (candidate.score < options.min_relative_score * best_near) break;
    if (std::ranges::binary_search(near, id) || !map.keyframes().contains(id)) continue;
    if (has_metric_submap(map, id) != has_metric_submap(map, query)) continue;
    std::size_t& count = map.keyframes().at(id).submap == own ? num_own : num_others;
    const auto num_linked = std::ranges::count_if(
        alike, [&](KeyframeId chosen) { return are_linked(map, chosen, id); });
    if (count == static_cast<std::size_t>(options.max_candidates) ||
        num_linked >= options.max_of_one_place)
      continue;
    alike.push_back(id);
    ++count;
  }
  return alike;
}

}  // namespace waymark

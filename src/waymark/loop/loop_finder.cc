// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_finder.h"

#include <algorithm>

#include "waymark/loop/drift.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCandidates = 3;
/// Keyframes so many steps away that each share so many landmarks are the query's surroundings.
constexpr int kNumNearSteps = 2;
constexpr std::uint32_t kMinShared = 15;
/// Of the best score within the surroundings.
constexpr double kMinRelativeScore = 0.1;

/// What a revisit must have at least. In the shelves of a warehouse and the arcades of an atrium
/// that are alike, false ones had up to 37 inliers and a share of 0.13.
struct Demand {
  std::size_t num_inliers;
  std::size_t num_found;
  double share;  ///< Of what both sides should see.
  std::size_t num_witnesses;
};
constexpr Demand kOfLoops{25, 40, 0.15, 1};
constexpr Demand kOfJoins{50, 80, 0.25, 2};

/// The query and its surroundings, ascending.
std::vector<KeyframeId> surroundings(const Map& map, KeyframeId query) {
  std::vector<KeyframeId> near = {query};
  std::vector<KeyframeId> front = near;
  for (int step = 0; step < kNumNearSteps; ++step) {
    std::vector<KeyframeId> next;
    for (KeyframeId id : front) {
      const KeyframeId parent = map.keyframes().at(id).parent;
      if (parent.is_valid()) next.push_back(parent);
      for (const CovisibilityEdge& edge : map.covisible(id)) {
        if (edge.num_shared >= kMinShared) next.push_back(edge.keyframe);
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

}  // namespace

std::vector<KeyframeId> find_candidates(const Map& map,
                                        const PlaceIndex& places,
                                        KeyframeId query,
                                        std::size_t max_count) {
  const std::vector<KeyframeId> near = surroundings(map, query);
  const auto is_near = [&](KeyframeId id) {
    return std::binary_search(near.begin(), near.end(), id);
  };
  const auto ranked =
      places.find(map.keyframes().at(query).features->descriptors,
                  {.max_candidates = near.size() + max_count,
                   .is_excluded = [&](const PlaceRow& row) { return row.keyframe == query; }});
  double best_near = 0.0;
  std::vector<KeyframeId> candidates;
  for (const PlaceCandidate& candidate : ranked) {
    if (is_near(candidate.keyframe)) best_near = std::max(best_near, candidate.score);
  }
  for (const PlaceCandidate& candidate : ranked) {
    if (is_near(candidate.keyframe) || !map.keyframes().contains(candidate.keyframe)) continue;
    if (candidates.size() == max_count || candidate.score < kMinRelativeScore * best_near) break;
    candidates.push_back(candidate.keyframe);
  }
  return candidates;
}

bool is_convincing(const Map& map, const RevisitEvidence& evidence) {
  const Revisit& revisit = evidence.revisit;
  const bool is_loop =
      map.keyframes().at(revisit.query).submap == map.keyframes().at(revisit.match).submap;
  const Demand& demand = is_loop ? kOfLoops : kOfJoins;
  const Sightings both{evidence.in_query.num_found + evidence.in_match.num_found,
                       evidence.in_query.num_visible + evidence.in_match.num_visible};
  return revisit.num_inliers >= demand.num_inliers &&
         evidence.in_query.num_found >= demand.num_found &&
         evidence.in_match.num_found >= demand.num_found && both.share() >= demand.share &&
         evidence.num_witnesses >= demand.num_witnesses &&
         (!is_loop || is_plausible_loop(map, revisit));
}

LoopFinder::LoopFinder(std::shared_ptr<const Rig> rig, std::uint64_t seed)
    : verifier_(std::move(rig), seed) {}

std::optional<Revisit> LoopFinder::find(const Map& map,
                                        const PlaceIndex& places,
                                        KeyframeId query) {
  for (KeyframeId match : find_candidates(map, places, query, kMaxCandidates)) {
    const std::optional<RevisitEvidence> evidence = verifier_.examine(map, query, match);
    if (evidence && is_convincing(map, *evidence)) return evidence->revisit;
  }
  return std::nullopt;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_finder.h"

#include <algorithm>

#include "waymark/loop/drift.h"
#include "waymark/loop/near_in_graph.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCandidates = 4;
/// Of keyframes that see the same, so many are candidates, so that others have their turn.
constexpr int kMaxOfOnePlace = 2;
constexpr std::size_t kNumRanked = 12;
/// Keyframes so many steps away are the query's surroundings.
constexpr int kNumNearSteps = 2;
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
constexpr Demand kOfJoins{30, 60, 0.15, 1};
/// Two revisits of one query agree within this, in radians and in parts of the depth of the scene.
constexpr double kMaxDisagreement = 0.2;

bool are_linked(const Map& map, KeyframeId a, KeyframeId b) {
  const auto& edges = map.covisible(a);
  return std::any_of(edges.begin(), edges.end(), [&](const CovisibilityEdge& edge) {
    return edge.keyframe == b && edge.num_shared >= kMinSharedOfLinked;
  });
}

const Submap& submap_of(const Map& map, KeyframeId id) {
  return map.submaps()[map.keyframes().at(id).submap.value];
}

bool meets(const RevisitEvidence& evidence, const Demand& demand) {
  const Sightings both{evidence.in_query.num_found + evidence.in_match.num_found,
                       evidence.in_query.num_visible + evidence.in_match.num_visible};
  return evidence.revisit.num_inliers >= demand.num_inliers &&
         evidence.in_query.num_found >= demand.num_found &&
         evidence.in_match.num_found >= demand.num_found && both.share() >= demand.share &&
         evidence.num_witnesses >= demand.num_witnesses;
}

bool is_loop(const Map& map, const Revisit& revisit) {
  return map.keyframes().at(revisit.query).submap == map.keyframes().at(revisit.match).submap;
}

/// Whether two revisits of one query put it at the same place of the same sub-map.
bool agree(const Map& map, const Revisit& a, const Revisit& b) {
  const Keyframe& match_a = map.keyframes().at(a.match);
  const Keyframe& match_b = map.keyframes().at(b.match);
  if (match_a.submap != match_b.submap) return true;  // Of different worlds: nothing to compare.
  const Rigid3 pose_a = pose_in_other_world(a.query_from_match, match_a.rig_from_world);
  const Rigid3 pose_b = pose_in_other_world(b.query_from_match, match_b.rig_from_world);
  const Rigid3 difference = pose_a * pose_b.inverse();
  return difference.translation.norm() < kMaxDisagreement * median_depth(map, a.match) &&
         Eigen::AngleAxisd(difference.rotation).angle() < kMaxDisagreement;
}

/// The one with most inliers, unless another contradicts it.
std::optional<Revisit> choose(const Map& map,
                              const std::vector<RevisitEvidence>& all,
                              const Demand& demand) {
  const auto& best = *std::max_element(
      all.begin(), all.end(), [](const RevisitEvidence& a, const RevisitEvidence& b) {
        return a.revisit.num_inliers < b.revisit.num_inliers;
      });
  const bool is_clear = std::all_of(all.begin(), all.end(), [&](const RevisitEvidence& other) {
    return agree(map, best.revisit, other.revisit);
  });
  if (!is_clear || !meets(best, demand)) return std::nullopt;
  return best.revisit;
}

}  // namespace

std::vector<KeyframeId> find_candidates(const Map& map,
                                        const PlaceIndex& places,
                                        KeyframeId query,
                                        std::size_t max_count) {
  const std::vector<KeyframeId> near = within_steps(map, query, kNumNearSteps);
  const auto is_near = [&](KeyframeId id) {
    return std::binary_search(near.begin(), near.end(), id);
  };
  const auto ranked =
      places.find(map.keyframes().at(query).features->descriptors,
                  {.max_candidates = near.size() + kNumRanked,
                   .is_excluded = [&](const PlaceRow& row) { return row.keyframe == query; }});
  double best_near = 0.0;
  std::vector<KeyframeId> candidates;
  for (const PlaceCandidate& candidate : ranked) {
    if (is_near(candidate.keyframe)) best_near = std::max(best_near, candidate.score);
  }
  for (const PlaceCandidate& candidate : ranked) {
    const KeyframeId id = candidate.keyframe;
    if (is_near(id) || !map.keyframes().contains(id)) continue;
    if (submap_of(map, id).is_metric != submap_of(map, query).is_metric) continue;
    if (candidates.size() == max_count || candidate.score < kMinRelativeScore * best_near) break;
    const auto num_linked =
        std::count_if(candidates.begin(), candidates.end(), [&](KeyframeId chosen) {
          return are_linked(map, chosen, id);
        });
    if (num_linked < kMaxOfOnePlace) candidates.push_back(id);
  }
  return candidates;
}

LoopFinder::LoopFinder(std::shared_ptr<const Rig> rig, std::uint64_t seed)
    : verifier_(std::move(rig), seed) {}

std::optional<Revisit> LoopFinder::find(const Map& map,
                                        const PlaceIndex& places,
                                        KeyframeId query) {
  std::vector<RevisitEvidence> loops;
  std::vector<RevisitEvidence> joins;
  bool has_twin = false;
  for (KeyframeId match : find_candidates(map, places, query, kMaxCandidates)) {
    std::optional<RevisitEvidence> evidence = verifier_.examine(map, query, match);
    if (!evidence || !meets(*evidence, kOfLoops)) continue;
    if (!is_loop(map, evidence->revisit)) {
      joins.push_back(std::move(*evidence));
    } else if (is_plausible_loop(map, evidence->revisit)) {
      loops.push_back(std::move(*evidence));
    } else {
      has_twin = true;
    }
  }
  if (!loops.empty()) return choose(map, loops, kOfLoops);
  // Where one sub-map has two places alike, one of them says nothing of another sub-map.
  if (has_twin || joins.empty()) return std::nullopt;
  return choose(map, joins, kOfJoins);
}

}  // namespace waymark

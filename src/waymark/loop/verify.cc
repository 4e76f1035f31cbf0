// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/verify.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/adaptive_threshold.h"
#include "waymark/base/median.h"
#include "waymark/camera/rig.h"
#include "waymark/loop/ambiguity.h"
#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"

namespace waymark {
namespace {

/// That either of two keyframes has at least.
std::size_t num_features_of(const Map& map, KeyframeId a, KeyframeId b) {
  return std::min(map.keyframes().at(a).features->num_corners(),
                  map.keyframes().at(b).features->num_corners());
}

bool meets(const Map& map,
           const ScoredCandidate& scored,
           int min_inliers,
           int min_found,
           double min_share) {
  const LoopCandidate& candidate = scored.candidate;
  const std::size_t num_features = num_features_of(map, candidate.query, candidate.match);
  const auto is_enough = [&](std::size_t count, int full) {
    return static_cast<int>(count) >= adaptive_threshold(full, num_features);
  };
  const VisibleShare both{scored.in_query.num_found + scored.in_match.num_found,
                          scored.in_query.num_visible + scored.in_match.num_visible};
  return is_enough(candidate.num_inliers, min_inliers) &&
         is_enough(scored.in_query.num_found, min_found) &&
         is_enough(scored.in_match.num_found, min_found) && both.share() >= min_share &&
         scored.is_confirmed;
}

bool is_loop(const Map& map, const LoopCandidate& candidate) {
  return map.keyframes().at(candidate.query).submap == map.keyframes().at(candidate.match).submap;
}

/// The one with most inliers, unless another contradicts it, or a place of the query's own sub-map
/// is an alias: where one sub-map has two places alike, one of them says nothing of another
/// sub-map.
std::optional<LoopCandidate> choose_join(const Map& map,
                                         const std::vector<ScoredCandidate>& joins,
                                         const std::vector<ScoredCandidate>& loops,
                                         const VerificationOptions& options) {
  const ScoredCandidate& best = *std::ranges::max_element(
      joins, {}, [](const ScoredCandidate& one) { return one.candidate.num_inliers; });
  const bool is_clear = std::ranges::all_of(joins, [&](const ScoredCandidate& other) {
    return agree(map, best.candidate, other.candidate);
  });
  const bool has_alias = std::ranges::any_of(loops, [&](const ScoredCandidate& loop) {
    return is_alias(loop.candidate, best.candidate.num_inliers);
  });
  const bool is_enough =
      meets(map, best, options.min_inliers_of_join, options.min_found_of_join, options.min_share);
  return is_clear && !has_alias && is_enough ? std::optional(best.candidate) : std::nullopt;
}

/// Features of a keyframe that show a landmark of its own and another one.
std::vector<LoopCandidate::Pair> pair_up(const Keyframe& keyframe,
                                         const std::vector<LandmarkId>& others) {
  std::vector<LoopCandidate::Pair> pairs;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    const LandmarkId own = keyframe.landmarks[i];
    if (own.is_valid() && others[i].is_valid() && own != others[i]) {
      pairs.push_back({own, others[i]});
    }
  }
  return pairs;
}

/// How much further away the query's landmarks are than those of the match, seen from the query;
/// keeps the pairs that agree on it.
double find_scale(const Map& map,
                  const Rigid3& query_from_world,
                  const Rigid3& query_from_world_of_match,
                  std::vector<LoopCandidate::Pair>& pairs,
                  double max_ratio_error) {
  const auto ratio_of = [&](const LoopCandidate::Pair& pair) {
    const Landmark& of_query = map.landmarks().at(pair.of_query);
    const Landmark& of_match = map.landmarks().at(pair.of_match);
    return (query_from_world * of_query.position_in_world).norm() /
           (query_from_world_of_match * of_match.position_in_world).norm();
  };
  if (pairs.empty()) return 1.0;
  std::vector<double> ratios;
  for (const LoopCandidate::Pair& pair : pairs) ratios.push_back(ratio_of(pair));
  const double scale = median(ratios);
  std::erase_if(pairs, [&](const LoopCandidate::Pair& pair) {
    return std::abs(std::log(ratio_of(pair) / scale)) > max_ratio_error;
  });
  return scale;
}

}  // namespace

std::optional<LoopCandidate> LoopVerifier::verify_alike(const Map& map,
                                                        const PlaceIndex& places,
                                                        KeyframeId query) {
  std::vector<ScoredCandidate> loops;
  std::vector<ScoredCandidate> joins;
  for (ScoredCandidate& scored : score_alike(map, places, query)) {
    (is_loop(map, scored.candidate) ? loops : joins).push_back(std::move(scored));
  }
  std::optional<LoopCandidate> chosen = choose_loop(map, loops);
  if (!chosen && !joins.empty()) chosen = choose_join(map, joins, loops, options_.verification);
  return chosen && is_unambiguous(map, places, *chosen) ? chosen : std::nullopt;
}

std::vector<ScoredCandidate> LoopVerifier::score_alike(const Map& map,
                                                       const PlaceIndex& places,
                                                       KeyframeId query) {
  const VerificationOptions& options = options_.verification;
  std::vector<ScoredCandidate> found;
  for (const KeyframeId match : find_alike(map, places, query, options_.candidates)) {
    const int least =
        adaptive_threshold(options.min_inliers_of_loop, num_features_of(map, query, match));
    std::optional<ScoredCandidate> scored =
        scorer_.score(map, query, match, static_cast<std::size_t>(least));
    if (scored && meets(map,
                        *scored,
                        options.min_inliers_of_loop,
                        options.min_found_of_loop,
                        options.min_share))
      found.push_back(std::move(*scored));
  }
  return found;
}

bool LoopVerifier::is_unambiguous(const Map& map,
                                  const PlaceIndex& places,
                                  const LoopCandidate& candidate) {
  const bool is_join = !is_loop(map, candidate);
  for (const ScoredCandidate& alike : score_alike(map, places, candidate.match)) {
    if (!is_loop(map, alike.candidate) || is_plausible_loop(map, alike.candidate)) continue;
    if (is_join || !outweighs(map, candidate, drift_in_depths(map, alike.candidate))) return false;
  }
  return true;
}

std::optional<LoopCandidate> LoopVerifier::verify_spatial_neighbours(
    const Map& map, KeyframeId query, std::span<const KeyframeId> candidates) {
  const Rig& rig = map.keyframes().at(query).rig();
  const auto match = std::ranges::find_if(
      candidates, [&](KeyframeId id) { return is_same_rig(map.keyframes().at(id).rig(), rig); });
  return match == candidates.end() ? std::nullopt : compare_with_neighbour(map, query, *match);
}

std::optional<LoopCandidate> LoopVerifier::compare_with_neighbour(const Map& map,
                                                                  KeyframeId query,
                                                                  KeyframeId match) {
  const Keyframe& in_query = map.keyframes().at(query);
  const auto place = locator_.locate_near(*in_query.features, map, match, in_query.rig_from_world);
  if (!place) return std::nullopt;
  LoopCandidate candidate;
  candidate.query = query;
  candidate.match = match;
  candidate.num_inliers = static_cast<std::size_t>(place->frame.num_inliers);
  candidate.pairs = pair_up(in_query, place->frame.landmarks);
  const double scale = find_scale(map,
                                  in_query.rig_from_world,
                                  place->frame.rig_from_world,
                                  candidate.pairs,
                                  options_.verification.max_ratio_error);
  if (candidate.pairs.size() <
      static_cast<std::size_t>(options_.verification.min_pairs_of_neighbours))
    return std::nullopt;
  const Rigid3 query_from_match =
      place->frame.rig_from_world * map.keyframes().at(match).rig_from_world.inverse();
  candidate.query_from_match = Sim3(query_from_match);
  if (!has_metric_submap(map, query)) {
    candidate.query_from_match.scale = scale;
    candidate.query_from_match.translation *= scale;
  }
  return is_plausible_loop(map, candidate) ? std::optional(candidate) : std::nullopt;
}

}  // namespace waymark

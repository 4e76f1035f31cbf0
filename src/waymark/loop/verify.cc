// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/verify.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/camera/rig.h"
#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"
#include "waymark/loop/rivals.h"
#include "waymark/track/enough.h"

namespace waymark {
namespace {

/// What a revisit must have at least. In the shelves of a warehouse and the arcades of an atrium
/// that are alike, false ones had up to 37 inliers and a share of 0.13.
/// Where the images offer little, what is enough of that.
struct Demand {
  int num_inliers;
  int num_found;
};
constexpr Demand kOfLoops{25, 40};
constexpr Demand kOfJoins{30, 60};
constexpr double kMinShare = 0.15;  ///< Of what both sides should see.

/// Features of the query that show landmarks of both sides, and their distances in the same ratio.
constexpr std::size_t kMinPairsBeside = 10;
constexpr double kMaxRatioError = 0.15;

/// That either of two keyframes has at least.
std::size_t num_features_of(const Map& map, KeyframeId a, KeyframeId b) {
  return std::min(map.keyframes().at(a).features->num_corners(),
                  map.keyframes().at(b).features->num_corners());
}

bool meets(const Map& map, const RevisitEvidence& evidence, const Demand& demand) {
  const Revisit& revisit = evidence.revisit;
  const std::size_t num_features = num_features_of(map, revisit.query, revisit.match);
  const auto is_enough = [&](std::size_t count, int full) {
    return static_cast<int>(count) >= enough_of(full, num_features);
  };
  const Sightings both{evidence.in_query.num_found + evidence.in_match.num_found,
                       evidence.in_query.num_visible + evidence.in_match.num_visible};
  return is_enough(revisit.num_inliers, demand.num_inliers) &&
         is_enough(evidence.in_query.num_found, demand.num_found) &&
         is_enough(evidence.in_match.num_found, demand.num_found) && both.share() >= kMinShare &&
         evidence.is_confirmed;
}

bool is_loop(const Map& map, const Revisit& revisit) {
  return map.keyframes().at(revisit.query).submap == map.keyframes().at(revisit.match).submap;
}

/// The one with most inliers, unless another contradicts it, or a place of the query's own sub-map
/// is a rival: where one sub-map has two places alike, one of them says nothing of another sub-map.
std::optional<Revisit> choose_join(const Map& map,
                                   const std::vector<RevisitEvidence>& joins,
                                   const std::vector<RevisitEvidence>& loops) {
  const RevisitEvidence& best = *std::ranges::max_element(
      joins, {}, [](const RevisitEvidence& one) { return one.revisit.num_inliers; });
  const bool is_clear = std::ranges::all_of(
      joins, [&](const RevisitEvidence& other) { return agree(map, best.revisit, other.revisit); });
  const bool has_rival = std::ranges::any_of(loops, [&](const RevisitEvidence& loop) {
    return is_rival(loop.revisit, best.revisit.num_inliers);
  });
  return is_clear && !has_rival && meets(map, best, kOfJoins) ? std::optional(best.revisit)
                                                              : std::nullopt;
}

/// Features of a keyframe that show a landmark of its own and another one.
std::vector<Revisit::Pair> pair_up(const Keyframe& keyframe,
                                   const std::vector<LandmarkId>& others) {
  std::vector<Revisit::Pair> pairs;
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
                  std::vector<Revisit::Pair>& pairs) {
  const auto ratio_of = [&](const Revisit::Pair& pair) {
    const Landmark& of_query = map.landmarks().at(pair.of_query);
    const Landmark& of_match = map.landmarks().at(pair.of_match);
    return (query_from_world * of_query.position_in_world).norm() /
           (query_from_world_of_match * of_match.position_in_world).norm();
  };
  if (pairs.empty()) return 1.0;
  std::vector<double> ratios;
  for (const Revisit::Pair& pair : pairs) ratios.push_back(ratio_of(pair));
  const double scale = median(ratios);
  std::erase_if(pairs, [&](const Revisit::Pair& pair) {
    return std::abs(std::log(ratio_of(pair) / scale)) > kMaxRatioError;
  });
  return scale;
}

}  // namespace

RevisitVerifier::RevisitVerifier(std::shared_ptr<const Rig> rig, std::uint64_t seed)
    : rig_(rig), evidence_(rig, seed), locator_(rig, seed) {}

std::optional<Revisit> RevisitVerifier::verify_alike(const Map& map,
                                                     const PlaceIndex& places,
                                                     KeyframeId query) {
  std::vector<RevisitEvidence> loops;
  std::vector<RevisitEvidence> joins;
  for (RevisitEvidence& evidence : collect_alike(map, places, query)) {
    (is_loop(map, evidence.revisit) ? loops : joins).push_back(std::move(evidence));
  }
  std::optional<Revisit> chosen = choose_loop(map, loops);
  if (!chosen && !joins.empty()) chosen = choose_join(map, joins, loops);
  return chosen && is_unrivalled(map, places, *chosen) ? chosen : std::nullopt;
}

std::vector<RevisitEvidence> RevisitVerifier::collect_alike(const Map& map,
                                                            const PlaceIndex& places,
                                                            KeyframeId query) {
  std::vector<RevisitEvidence> found;
  for (const KeyframeId match : find_alike(map, places, query)) {
    const int least = enough_of(kOfLoops.num_inliers, num_features_of(map, query, match));
    std::optional<RevisitEvidence> evidence =
        evidence_.collect(map, query, match, static_cast<std::size_t>(least));
    if (evidence && meets(map, *evidence, kOfLoops)) found.push_back(std::move(*evidence));
  }
  return found;
}

bool RevisitVerifier::is_unrivalled(const Map& map,
                                    const PlaceIndex& places,
                                    const Revisit& revisit) {
  const bool is_join = !is_loop(map, revisit);
  for (const RevisitEvidence& alike : collect_alike(map, places, revisit.match)) {
    if (!is_loop(map, alike.revisit) || is_plausible_loop(map, alike.revisit)) continue;
    if (is_join || !outdoes(map, revisit, drift_in_depths(map, alike.revisit))) return false;
  }
  return true;
}

std::optional<Revisit> RevisitVerifier::verify_beside(const Map& map,
                                                      KeyframeId query,
                                                      std::span<const KeyframeId> candidates) {
  const auto is_own = [&](KeyframeId id) {
    return is_same_rig(*map.keyframes().at(id).rig, *rig_);
  };
  if (!is_own(query)) return std::nullopt;
  const auto match = std::find_if(candidates.begin(), candidates.end(), is_own);
  return match == candidates.end() ? std::nullopt : compare_beside(map, query, *match);
}

std::optional<Revisit> RevisitVerifier::compare_beside(const Map& map,
                                                       KeyframeId query,
                                                       KeyframeId match) {
  const Keyframe& in_query = map.keyframes().at(query);
  const auto place = locator_.locate_near(*in_query.features, map, match, in_query.rig_from_world);
  if (!place) return std::nullopt;
  Revisit revisit;
  revisit.query = query;
  revisit.match = match;
  revisit.num_inliers = static_cast<std::size_t>(place->frame.num_inliers);
  revisit.pairs = pair_up(in_query, place->frame.landmarks);
  const double scale =
      find_scale(map, in_query.rig_from_world, place->frame.rig_from_world, revisit.pairs);
  if (revisit.pairs.size() < kMinPairsBeside) return std::nullopt;
  const Rigid3 query_from_match =
      place->frame.rig_from_world * map.keyframes().at(match).rig_from_world.inverse();
  revisit.query_from_match = Sim3(query_from_match);
  if (!has_metric_submap(map, query)) {
    revisit.query_from_match.scale = scale;
    revisit.query_from_match.translation *= scale;
  }
  return is_plausible_loop(map, revisit) ? std::optional(revisit) : std::nullopt;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/link_finder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/camera/same_rig.h"
#include "waymark/loop/beside.h"
#include "waymark/loop/drift.h"

namespace waymark {
namespace {

/// Keyframes so many steps away in the graph are known to each other well enough.
constexpr int kNumNearLinkSteps = 5;
/// Beyond this ORB features change too much.
constexpr ViewReach kLinkReach = {0.8, 0.7};
/// Features of the query that show landmarks of both sides, and their distances in the same ratio.
constexpr std::size_t kMinPairs = 10;
constexpr double kMaxRatioError = 0.15;

/// The nearest in space of those that the graph does not know to be near.
KeyframeId nearest_unknown(const Map& map, KeyframeId query) {
  const Rig& rig = *map.keyframes().at(query).rig;
  for (const KeyframeId id : strangers_beside(map, query, kNumNearLinkSteps, kLinkReach)) {
    if (is_same_rig(*map.keyframes().at(id).rig, rig)) return id;
  }
  return {};
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

LinkFinder::LinkFinder(std::shared_ptr<const Rig> rig, std::uint64_t seed)
    : rig_(rig), locator_(rig, seed) {}

std::optional<Revisit> LinkFinder::find(const Map& map, KeyframeId query) {
  if (!is_same_rig(*map.keyframes().at(query).rig, *rig_)) return std::nullopt;
  const KeyframeId match = nearest_unknown(map, query);
  return match.is_valid() ? compare(map, query, match) : std::nullopt;
}

std::optional<Revisit> LinkFinder::compare(const Map& map, KeyframeId query, KeyframeId match) {
  const Keyframe& in_query = map.keyframes().at(query);
  const auto place =
      locator_.locate_near(*in_query.features, map, match, in_query.rig_from_world, seen_);
  if (!place) return std::nullopt;
  Revisit revisit;
  revisit.query = query;
  revisit.match = match;
  revisit.num_inliers = static_cast<std::size_t>(place->frame.num_inliers);
  revisit.pairs = pair_up(in_query, seen_);
  const double scale =
      find_scale(map, in_query.rig_from_world, place->frame.rig_from_world, revisit.pairs);
  if (revisit.pairs.size() < kMinPairs) return std::nullopt;
  const Rigid3 query_from_match =
      place->frame.rig_from_world * map.keyframes().at(match).rig_from_world.inverse();
  revisit.query_from_match = Sim3(query_from_match);
  if (!map.submaps()[in_query.submap.value].is_metric) {
    revisit.query_from_match.scale = scale;
    revisit.query_from_match.translation *= scale;
  }
  if (!is_plausible_loop(map, revisit)) return std::nullopt;
  return revisit;
}

}  // namespace waymark

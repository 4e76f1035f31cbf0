// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/link_tiles.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/base/rng.h"
#include "waymark/geometry/alignment.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/map/parts.h"
#include "waymark/place/map_snapshot.h"

namespace waymark {
namespace {

/// More queries than these rarely find what they did not.
constexpr std::size_t kMaxQueries = 12;
/// As many as a join must show.
constexpr std::size_t kMinSharedLandmarks = 60;
constexpr int kNumFits = 3;
constexpr std::size_t kSampleSize = 3;
constexpr int kNumSamples = 100;
constexpr double kMaxOff = 3.0;

/// A tile beside another in one map.
struct TileBeside {
  KeyframeId first_keyframe;
  KeyframeId end_keyframe;
  std::uint32_t first_landmark = 0;
};

struct TilesSideBySide {
  Map map;
  TileBeside a;
  TileBeside b;
};

/// A map whose units are said to be any.
Map as_free(const Map& map) {
  MapParts parts = take_apart(map);
  for (Submap& submap : parts.submaps) submap.is_metric = false;
  return Map::restore(std::move(parts));
}

/// Of two kinds of units the map has those of neither, for one to be scaled to the other. What is
/// older stays when sub-maps become one: that is the tile in metres, whose cameras measure them.
TilesSideBySide unite_tiles(const Map& a, const Map& b) {
  const auto beside = [](const Map& before) {
    return TileBeside{before.keyframes().end_id(), {}, before.landmarks().end_id().value};
  };
  TilesSideBySide both;
  if (is_metric(a) == is_metric(b)) {
    both = {unite(a, b), beside(Map()), beside(a)};
  } else if (is_metric(a)) {
    both = {unite(as_free(a), b), beside(Map()), beside(a)};
  } else {
    both = {unite(as_free(b), a), beside(b), beside(Map())};
  }
  both.a.end_keyframe = {both.a.first_keyframe.value + a.keyframes().end_id().value};
  both.b.end_keyframe = {both.b.first_keyframe.value + b.keyframes().end_id().value};
  return both;
}

/// Pairs of landmarks of both that became one.
SharedLandmarks became_one(const Map& merged,
                           const Map& a,
                           const Map& b,
                           const TilesSideBySide& both) {
  std::map<LandmarkId, LandmarkId> of_a;  // By survivor, the first of each.
  a.landmarks().for_each([&](LandmarkId id, const Landmark&) {
    const LandmarkId survivor = merged.resolve(LandmarkId{id.value + both.a.first_landmark});
    if (survivor.is_valid()) of_a.try_emplace(survivor, id);
  });
  std::set<LandmarkId> done;
  SharedLandmarks shared;
  b.landmarks().for_each([&](LandmarkId id, const Landmark&) {
    const LandmarkId survivor = merged.resolve(LandmarkId{id.value + both.b.first_landmark});
    const auto at = of_a.find(survivor);
    if (!survivor.is_valid() || at == of_a.end() || !done.insert(survivor).second) return;
    shared.push_back({at->second, id});
  });
  std::ranges::sort(shared);
  return shared;
}

/// Where two tiles have what they share.
struct PointPairs {
  std::vector<Eigen::Vector3d> in_a;
  std::vector<Eigen::Vector3d> in_b;
  std::vector<double> fineness;  ///< The inverse of what a pixel covers there.

  /// How far each pair is off, in pixels.
  std::vector<double> off(const Sim3& b_from_a) const {
    std::vector<double> distances;
    for (std::size_t i = 0; i < in_a.size(); ++i) {
      distances.push_back(fineness[i] * (b_from_a * in_a[i] - in_b[i]).norm());
    }
    return distances;
  }
};

PointPairs gather_pairs(const Map& a, const Map& b, const SharedLandmarks& shared) {
  PointPairs pairs;
  for (const auto& [of_a, of_b] : shared) {
    const Landmark* const landmark_a = a.landmarks().find(of_a);
    const Landmark* const landmark_b = b.landmarks().find(of_b);
    if (!landmark_a || !landmark_b || !(landmark_b->appearance.size_m > 0.0)) continue;
    pairs.in_a.push_back(landmark_a->position_in_world);
    pairs.in_b.push_back(landmark_b->position_in_world);
    pairs.fineness.push_back(1.0 / landmark_b->appearance.size_m);
  }
  return pairs;
}

std::optional<Sim3> fit_pairs(std::span<const Eigen::Vector3d> in_a,
                              std::span<const Eigen::Vector3d> in_b,
                              std::span<const double> weights,
                              bool is_rigid) {
  if (!is_rigid) return align_similarity(in_a, in_b, weights);
  const std::optional<Rigid3> rigid = align_rigid(in_a, in_b, weights);
  return rigid ? std::optional(Sim3(*rigid)) : std::nullopt;
}

/// Of samples of three pairs the one that the middling pair is least off from (least median of
/// squares; Rousseeuw 1984): points that were seen from nearly one place may be anywhere.
std::optional<Sim3> fit_least_median(const PointPairs& pairs, bool is_rigid) {
  Rng rng(0, 0);
  std::optional<Sim3> best;
  double least = std::numeric_limits<double>::infinity();
  const auto count = static_cast<std::uint32_t>(pairs.in_a.size());
  for (int i = 0; i < kNumSamples; ++i) {
    std::vector<Eigen::Vector3d> in_a, in_b;
    for (std::size_t k = 0; k < kSampleSize; ++k) {
      const std::uint32_t chosen = rng.below(count);
      in_a.push_back(pairs.in_a[chosen]);
      in_b.push_back(pairs.in_b[chosen]);
    }
    const std::optional<Sim3> fit = fit_pairs(in_a, in_b, {}, is_rigid);
    if (!fit) continue;
    const double middling = median(pairs.off(*fit));
    if (!(middling < least)) continue;
    least = middling;
    best = fit;
  }
  return best;
}

}  // namespace

std::optional<SharedLandmarks> match_tiles(const Map& a,
                                           const Map& b,
                                           std::span<const KeyframeId> queries,
                                           std::uint64_t seed) {
  if (queries.empty()) return std::nullopt;
  TilesSideBySide both = unite_tiles(a, b);
  const auto id_of = [&](KeyframeId query) {
    return KeyframeId{both.b.first_keyframe.value + query.value};
  };
  const auto& rig = both.map.keyframes().at(id_of(queries[0])).features->rig;
  GlobalMapper mapper(rig, {}, {}, {.refine = "off"}, seed);
  mapper.take_over(index_map(both.map.freeze(), both.a.end_keyframe, both.a.first_keyframe));
  const auto tried = queries.first(std::min(queries.size(), kMaxQueries));
  const bool is_found = std::ranges::any_of(
      tried, [&](KeyframeId query) { return mapper.close_alike(id_of(query)); });
  if (!is_found || mapper.num_joins() == 0) return std::nullopt;
  mapper.consolidate();
  SharedLandmarks shared = became_one(mapper.map(), a, b, both);
  if (shared.size() < kMinSharedLandmarks) return std::nullopt;
  return shared;
}

std::optional<Sim3> fit_tiles(const Map& a, const Map& b, const SharedLandmarks& shared) {
  const PointPairs pairs = gather_pairs(a, b, shared);
  if (pairs.in_a.size() < kSampleSize) return std::nullopt;
  const bool is_rigid = is_metric(a) && is_metric(b);
  std::optional<Sim3> b_from_a = fit_least_median(pairs, is_rigid);
  for (int fit = 0; fit < kNumFits && b_from_a; ++fit) {
    const std::vector<double> off = pairs.off(*b_from_a);
    const double limit = kMaxOff * median(std::vector<double>(off));
    std::vector<double> weights;
    for (std::size_t i = 0; i < off.size(); ++i) {
      weights.push_back(off[i] <= limit ? pairs.fineness[i] * pairs.fineness[i] : 0.0);
    }
    b_from_a = fit_pairs(pairs.in_a, pairs.in_b, weights, is_rigid);
  }
  return b_from_a;
}

}  // namespace waymark

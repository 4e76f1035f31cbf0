// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/map_merger.h"

#include <optional>
#include <utility>
#include <vector>

#include "waymark/loop/close.h"
#include "waymark/loop/consolidate.h"
#include "waymark/loop/find.h"
#include "waymark/loop/verify.h"
#include "waymark/map/parts.h"
#include "waymark/mapping/mapper.h"

namespace waymark {
namespace {

/// A join makes loops of what was seen before it, which may let others be joined in turn.
constexpr int kMaxPasses = 4;
constexpr BesideOptions kMergeBeside = {.num_known_steps = 5, .distance = 0.8, .angle_rad = 0.7};

class MapMerger {
 public:
  /// Keyframes from `first` on look for places of those before.
  MapMerger(const Map& both, KeyframeId first, std::uint64_t seed)
      : first_(first),
        rig_(both.keyframes().at(first).rig),
        mapper_(rig_, {}),
        verifier_(rig_, seed),
        projection_(rig_) {
    mapper_.take_over(both);
    both.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (id < first_) places_.add(id, keyframe.submap, keyframe.features->descriptors);
    });
  }

  MergedMaps merge() {
    std::vector<KeyframeId> queries;
    mapper_.map().keyframes().for_each([&](KeyframeId id, const Keyframe&) {
      if (id >= first_) queries.push_back(id);
    });
    for (int pass = 0; pass < kMaxPasses; ++pass) {
      const int num_joins_before = merged_.num_joins;
      for (const KeyframeId query : queries) look_for_place_of(query);
      if (merged_.num_joins == num_joins_before) break;
    }
    if (merged_.num_joins > 0) finish();
    merged_.map = mapper_.freeze();
    return std::move(merged_);
  }

 private:
  void look_for_place_of(KeyframeId query) {
    const std::optional<Revisit> revisit =
        verifier_.verify_alike(mapper_.map(), query, find_alike(mapper_.map(), places_, query));
    if (!revisit) return;
    bool is_join = false;
    mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
      is_join = close_revisit(map, places_, *revisit, projection_, dirty);
    });
    ++(is_join ? merged_.num_joins : merged_.num_loops);
  }

  /// What was joined at one place may touch elsewhere, too.
  void finish() {
    mapper_.refine_globally();
    std::vector<KeyframeId> queries;
    mapper_.map().keyframes().for_each(
        [&](KeyframeId id, const Keyframe&) { queries.push_back(id); });
    for (const KeyframeId query : queries) {
      const std::optional<Revisit> link = verifier_.verify_beside(
          mapper_.map(), query, find_beside(mapper_.map(), query, kMergeBeside));
      if (!link) continue;
      mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
        close_revisit(map, places_, *link, projection_, dirty);
      });
      ++merged_.num_loops;
    }
    mapper_.change(
        [&](Map& map, DirtyLandmarks& dirty) { fuse_overlaps(map, projection_, dirty); });
    mapper_.refine_globally();
  }

  const KeyframeId first_;
  const std::shared_ptr<const Rig> rig_;
  Mapper mapper_;
  PlaceIndex places_;
  RevisitVerifier verifier_;
  ProjectionMatcher projection_;
  MergedMaps merged_;
};

}  // namespace

MergedMaps merge_maps(const Map& a, const Map& b, std::uint64_t seed) {
  Map both = unite(a, b);
  KeyframeId first;  // Of b.
  both.keyframes().for_each([&](KeyframeId id, const Keyframe&) {
    if (!first.is_valid() && id >= a.keyframes().end_id()) first = id;
  });
  const std::shared_ptr<const Map> frozen = both.freeze();
  if (!first.is_valid()) return {frozen};
  return MapMerger(*frozen, first, seed).merge();
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/map_merger.h"

#include <vector>

#include "waymark/loop/global_mapper.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

/// A join makes loops of what was seen before it, which may let others be joined in turn.
constexpr int kMaxPasses = 4;

/// A map whose keyframes are indexed below an id only, so that the others look for their places.
MapSnapshot index_below(KeyframeId end, std::shared_ptr<const Map> map) {
  const auto places = std::make_shared<PlaceIndex>();
  map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (id < end) places->add(id, keyframe.submap, keyframe.features->descriptors);
  });
  return {std::move(map), places};
}

}  // namespace

MergedMaps merge_maps(const Map& a, const Map& b, std::uint64_t seed) {
  Map both = unite(a, b);
  std::vector<KeyframeId> of_b;
  both.keyframes().for_each([&](KeyframeId id, const Keyframe&) {
    if (id >= a.keyframes().end_id()) of_b.push_back(id);
  });
  if (of_b.empty()) return {both.freeze()};
  GlobalMapper mapper(both.keyframes().at(of_b.front()).rig, {}, {}, seed);
  mapper.take_over(index_below(of_b.front(), both.freeze()));
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const int num_joins_before = mapper.num_joins();
    for (const KeyframeId query : of_b) mapper.close_alike(query);
    if (mapper.num_joins() == num_joins_before) break;
  }
  if (mapper.num_joins() > 0) mapper.consolidate();
  return {mapper.snapshot().map, mapper.num_joins(), mapper.num_loops()};
}

}  // namespace waymark

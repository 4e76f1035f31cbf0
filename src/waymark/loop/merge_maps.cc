// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/merge_maps.h"

#include <vector>

#include "waymark/loop/global_mapper.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

/// A join makes loops of what was seen before it, which may let others be joined in turn.
constexpr int kMaxPasses = 4;

}  // namespace

MergedMaps merge_maps(const Map& a, const Map& b, std::uint64_t seed) {
  Map both = unite(a, b);
  std::vector<KeyframeId> of_b;
  both.keyframes().for_each([&](KeyframeId id, const Keyframe&) {
    if (id >= a.keyframes().end_id()) of_b.push_back(id);
  });
  if (of_b.empty()) return {both.freeze()};
  GlobalMapper mapper(
      both.keyframes().at(of_b.front()).features->rig, {}, {}, {.refine = "off"}, seed);
  // Only what is indexed is found: b looks for its places in a.
  mapper.take_over(index_map(both.freeze(), of_b.front()));
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const int num_joins_before = mapper.num_joins();
    for (const KeyframeId query : of_b) mapper.close_alike(query);
    if (mapper.num_joins() == num_joins_before) break;
  }
  mapper.join_what_knows_the_same_markers();
  if (mapper.num_joins() > 0) mapper.consolidate();
  return {mapper.snapshot().map, mapper.num_joins(), mapper.num_loops()};
}

}  // namespace waymark

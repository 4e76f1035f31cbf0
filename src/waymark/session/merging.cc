// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/merging.h"

#include <algorithm>

#include "waymark/loop/merge_maps.h"

namespace waymark {
namespace {

std::size_t count_parts(const Map& map) {
  const auto is_part = [](const Submap& submap) { return submap.root.is_valid(); };
  return static_cast<std::size_t>(std::ranges::count_if(map.submaps(), is_part));
}

bool has_part(const Map& map, bool is_metric) {
  return std::ranges::any_of(map.submaps(), [&](const Submap& submap) {
    return submap.root.is_valid() && submap.is_metric == is_metric;
  });
}

}  // namespace

MergedStored merge_stored(const StoredMap& a, const StoredMap& b, std::uint64_t seed) {
  const MergedMaps maps = merge_maps(*a.map, *b.map, seed);
  MergedStored merged;
  merged.stored = a;
  merged.stored.map = maps.map;
  const std::uint32_t shift = a.map->keyframes().end_id().value;
  for (const auto& [id, jpeg] : b.images) {
    merged.stored.images.emplace(KeyframeId{id.value + shift}, jpeg);
  }
  merged.num_parts_before = count_parts(*a.map) + count_parts(*b.map);
  merged.num_parts = count_parts(*maps.map);
  merged.num_joins = maps.num_joins;
  merged.num_loops = maps.num_loops;
  merged.is_incomparable = !(has_part(*a.map, true) && has_part(*b.map, true)) &&
                           !(has_part(*a.map, false) && has_part(*b.map, false));
  return merged;
}

}  // namespace waymark

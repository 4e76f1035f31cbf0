// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/consolidate.h"

#include <vector>

#include "waymark/loop/find.h"
#include "waymark/mapping/fuse.h"

namespace waymark {
namespace {

/// Views further apart show too little of the same.
constexpr BesideOptions kOverlapping = {.num_known_steps = 1, .distance = 0.6, .angle_rad = 0.5};
constexpr std::size_t kMaxSources = 6;

}  // namespace

void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty) {
  const std::uint32_t end = map.keyframes().end_id().value;
  for (KeyframeId id{0}; id.value < end; ++id.value) {
    if (!map.keyframes().contains(id)) continue;
    std::vector<KeyframeId> sources = find_beside(map, id, kOverlapping);
    if (sources.size() > kMaxSources) sources.resize(kMaxSources);
    if (!sources.empty()) fuse_into(map, sources, id, matcher, dirty);
  }
}

}  // namespace waymark

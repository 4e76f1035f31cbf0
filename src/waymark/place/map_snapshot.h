// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// One moment of the map with the index of its keyframes. Immutable; both are never null.
struct MapSnapshot {
  std::shared_ptr<const Map> map = std::make_shared<const Map>();
  std::shared_ptr<const PlaceIndex> places = std::make_shared<const PlaceIndex>();
};

/// Snapshots that somebody may still look at. Who lets go of a map last frees what only that map
/// has, which after an adjustment is most of it: not for the tracker to do.
class SnapshotsInUse {
 public:
  /// Frees those before that nobody else has any more.
  MapSnapshot add(MapSnapshot snapshot) {
    std::erase_if(snapshots_, [](const MapSnapshot& old) {
      return old.map.use_count() == 1 && old.places.use_count() == 1;
    });
    snapshots_.push_back(snapshot);
    return snapshot;
  }

 private:
  std::vector<MapSnapshot> snapshots_;
};

/// A frozen map with the index of its keyframes from `begin` on and below `end`, else of all.
inline MapSnapshot index_map(std::shared_ptr<const Map> map,
                             KeyframeId end = {},
                             KeyframeId begin = KeyframeId{0}) {
  PlaceIndex places;
  map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (id >= begin && id < end)
      places.add(id, keyframe.submap, keyframe.features->corner_descriptors());
  });
  return {std::move(map), std::make_shared<const PlaceIndex>(std::move(places))};
}

}  // namespace waymark

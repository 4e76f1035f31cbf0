// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/map_snapshot.h"

#include <utility>

namespace waymark {

MapSnapshot index_map(std::shared_ptr<const Map> map) {
  PlaceIndex places;
  map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    places.add(id, keyframe.submap, keyframe.features->descriptors);
  });
  return {std::move(map), std::make_shared<const PlaceIndex>(std::move(places))};
}

}  // namespace waymark

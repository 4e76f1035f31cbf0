// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// One moment of the map with the index of its keyframes. Immutable; both are never null.
struct MapSnapshot {
  std::shared_ptr<const Map> map = std::make_shared<const Map>();
  std::shared_ptr<const PlaceIndex> places = std::make_shared<const PlaceIndex>();
};

/// A frozen map with the index of all its keyframes.
MapSnapshot index_map(std::shared_ptr<const Map> map);

}  // namespace waymark

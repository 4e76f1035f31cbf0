// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "waymark/map/testing/random_map.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {

/// What the map that journals belong to is made of.
inline testing::RandomMap map_with_journal() { return testing::RandomMap(0, 200, 4); }

/// A state of a small sound map, to be saved.
inline StoredMap small_stored_map(testing::RandomMap& random) {
  StoredMap stored;
  stored.map = random.map().freeze();
  stored.images[stored.map->submaps()[0].root] = std::make_shared<const std::string>("jpeg");
  return stored;
}

}  // namespace waymark

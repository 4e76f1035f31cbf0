// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/map/map.h"

namespace waymark {

/// A part of a map that is a map of its own, of one sub-map, in the frame that it had there. Its
/// ids count from 0 on and keep their order.
struct PartitionTile {
  Map map;
  SubmapId submap;                    ///< Of the whole map.
  std::vector<KeyframeId> keyframes;  ///< What each had been, by its id now.
  std::vector<LandmarkId> landmarks;  ///< The same.
};

/// What two of the tiles of a map show both.
struct TileBorder {
  std::size_t a = 0;  ///< Index of a tile.
  std::size_t b = 0;  ///< A later one of the same sub-map.
  SharedLandmarks landmarks;
};

/// A map in tiles.
struct PartitionedMap {
  std::vector<PartitionTile> tiles;
  std::vector<TileBorder> borders;  ///< Ascending by a, then by b.
};

/// Cuts a map into tiles of at most so many keyframes: each sub-map is halved across the direction
/// in which its keyframes spread most, the halves again, and so on (a k-d tree; Bentley 1975). What
/// a place shows is thus in one tile, however often the camera came by. Each tile has all landmarks
/// that its keyframes see, those at a border are in both. Tiles of one sub-map hang together
/// through borders. Pure: the same map gives the same tiles.
PartitionedMap partition_map(const Map& map, std::size_t max_keyframes);

}  // namespace waymark

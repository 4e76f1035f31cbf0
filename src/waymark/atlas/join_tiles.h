// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/map/map.h"

namespace waymark {

/// A tile and where it lies in the frame that several are to be put into.
struct PlacedTile {
  const Map* map = nullptr;
  Sim3 joined_from_tile;
  bool is_in_metres =
      false;  ///< Lengths of the frame are metres, also where those of the tile are not.
};

/// What two of several tiles share.
struct TileSeam {
  std::uint32_t a = 0;  ///< Index among the tiles.
  std::uint32_t b = 0;  ///< The same; another one.
  SharedLandmarks landmarks;
};

/// Tiles as one map. The ids of each follow those of the ones before it.
struct JoinedTiles {
  Map map;
  std::vector<std::uint32_t> first_keyframe;  ///< By tile.
  std::vector<std::uint32_t> first_landmark;  ///< By tile.
};

/// Puts tiles into one frame. What a seam ties belongs to one sub-map, and its landmarks are one:
/// that with the least id stays, where it is.
JoinedTiles join_tiles(std::span<const PlacedTile> tiles, std::span<const TileSeam> seams);

}  // namespace waymark

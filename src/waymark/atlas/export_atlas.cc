// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/export_atlas.h"

#include <utility>
#include <vector>

#include "waymark/atlas/anchors.h"
#include "waymark/atlas/join_tiles.h"

namespace waymark {

StoredMap export_atlas(const Atlas& atlas) {
  StoredMap result;
  std::vector<StoredMap> tiles;
  std::vector<PlacedTile> placed;
  const std::vector<bool> is_in_metres = frames_in_metres(atlas.contents());
  for (const AtlasTile& tile : atlas.contents().tiles) {
    tiles.push_back(atlas.load_tile(tile));
    placed.push_back({tiles.back().map.get(), tile.atlas_from_tile, is_in_metres[tile.frame]});
  }
  std::vector<TileSeam> seams;
  for (const AtlasLink& link : atlas.contents().links) {
    seams.push_back({link.a, link.b, atlas.read_shared(link)});
  }
  JoinedTiles joined = join_tiles(placed, seams);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    for (auto& [id, jpeg] : tiles[i].images) {
      result.images.emplace(KeyframeId{id.value + joined.first_keyframe[i]}, std::move(jpeg));
    }
  }
  if (!tiles.empty()) result.settings = tiles.front().settings;
  result.map = joined.map.freeze();
  return result;
}

StoredMap load_map_or_atlas(const std::filesystem::path& path) {
  return is_atlas(path) ? export_atlas(Atlas::open(path)) : load_map(path);
}

}  // namespace waymark

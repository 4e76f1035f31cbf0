// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// A keyframe of a tile that looks like an image.
struct AtlasCandidate {
  std::uint32_t tile = 0;  ///< Index of the tile.
  KeyframeId keyframe;     ///< Its id there.
  double score = 0.0;      ///< See PlaceCandidate.
};

/// Consecutive tiles.
struct TileRange {
  std::uint32_t begin = 0;         ///< Index of the first tile.
  std::uint32_t end = UINT32_MAX;  ///< One past the last; beyond the end: to the end.
};

/// Cuts the tiles into as few ranges as have at most so many keyframes each, but for single tiles
/// that have more; their sizes differ as little as the tiles allow, so that scores compare.
std::vector<TileRange> divide_tiles(const AtlasContents& contents, std::size_t max_keyframes);

/// The place index of all tiles, or of some, without opening them.
class AtlasPlaces {
 public:
  explicit AtlasPlaces(const Atlas& atlas) : AtlasPlaces(atlas, atlas.contents()) {}
  /// Of contents that are not committed yet.
  AtlasPlaces(const Atlas& atlas, const AtlasContents& contents, const TileRange& range = {});

  /// The best, best first; those of tiles that are not wanted are left out.
  std::vector<AtlasCandidate> find(
      std::span<const Descriptor> descriptors,
      std::size_t max_candidates,
      const std::function<bool(std::uint32_t)>& is_excluded = {}) const;

 private:
  std::vector<std::uint32_t> first_id_;  ///< In the index, by tile.
  PlaceIndex index_;
};

/// Tiles that may show a place of another one.
struct AlikeTile {
  std::uint32_t tile = 0;           ///< Index of the tile.
  double score = 0.0;               ///< The more, the likelier.
  std::vector<KeyframeId> queries;  ///< Keyframes of the other one that say so, likeliest first.
};

/// The tiles of other maps in this index that look most like a tile, at most so many, best first.
/// Depends on what the atlas holds, not on when it came.
std::vector<AlikeTile> find_alike_tiles(const AtlasContents& contents,
                                        const AtlasPlaces& places,
                                        std::uint32_t tile,
                                        const Map& map,
                                        std::size_t max_count);

/// Best first, at most so many; of equal ones those that come first.
void keep_best(std::vector<AlikeTile>& alike, std::size_t max_count);

}  // namespace waymark

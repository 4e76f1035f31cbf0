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

/// The place index of all tiles, without opening them.
class AtlasPlaces {
 public:
  explicit AtlasPlaces(const Atlas& atlas) : AtlasPlaces(atlas, atlas.contents()) {}
  /// Of contents that are not committed yet.
  AtlasPlaces(const Atlas& atlas, const AtlasContents& contents);

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

/// The tiles of other maps that look most like a tile of this index, at most so many, best first.
/// Depends on what the atlas holds, not on when it came.
std::vector<AlikeTile> find_alike_tiles(const AtlasContents& contents,
                                        const AtlasPlaces& places,
                                        std::uint32_t tile,
                                        const Map& map,
                                        std::size_t max_count);

}  // namespace waymark

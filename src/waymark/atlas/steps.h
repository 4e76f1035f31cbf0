// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/atlas/atlas_places.h"

namespace waymark {

// The steps that add maps to an atlas, each a pure function of the files of tiles.

/// A tile is compared with so many of the tiles of other maps that look most like it.
inline constexpr std::size_t kMaxLinksSought = 6;

/// Two tiles that may show the same place.
struct TilePair {
  std::uint32_t a = 0;              ///< Where to look.
  std::uint32_t b = 0;              ///< Whose keyframes to look for.
  std::vector<KeyframeId> queries;  ///< Of b, the likeliest first.
};

/// A recording cut into tiles whose files are in the folder of an atlas, which does not refer to
/// them yet.
struct CutRecording {
  AtlasContents contents;         ///< Of this recording alone, with its borders as links.
  std::vector<NewShared> shared;  ///< What the borders share.
};

/// Cuts a map into tiles and puts them into the folder. checksum: of the file of the map.
CutRecording cut_recording(Atlas& atlas,
                           const StoredMap& stored,
                           const std::string& checksum,
                           const std::string& name,
                           std::size_t max_keyframes);

/// Puts what another one holds behind contents, sorted. InputError where a tile is there twice.
void append_contents(AtlasContents& contents, const AtlasContents& more);

/// What find_alike_tiles() gave of tiles, as pairs, each once, ascending. by_tile: by the index of
/// the tile that was looked for; one that was looked for in several ranges of tiles is there once
/// per range, and the best kMaxLinksSought of all count.
std::vector<TilePair> choose_pairs(
    const std::vector<std::pair<std::uint32_t, std::vector<AlikeTile>>>& by_tile);

/// Looks for b in a, see match_tiles(), and says how they lie to each other.
struct FoundLink {
  AtlasLink link;
  NewShared shared;
};
std::optional<FoundLink> link_pair(const AtlasContents& contents,
                                   const TilePair& pair,
                                   const Map& a,
                                   const Map& b,
                                   std::uint64_t seed);

}  // namespace waymark

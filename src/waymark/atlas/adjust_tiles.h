// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/atlas/join_tiles.h"

namespace waymark {

/// The first of the tiles adjusted, all others held: its keyframes and what they see move to where
/// that and what the others see of the same landmarks agree best. Ids stay. Seams are those of the
/// first, which is put into the frame of all by a change of units alone. Pure; the map as it was
/// where nothing holds it.
Map adjust_tile(std::span<const PlacedTile> tiles, std::span<const TileSeam> seams);

/// Tiles that are to be adjusted, in groups of which each needs the ones before it: no two of a
/// group are linked. Those of parts in which nothing was recognised are not among them.
std::vector<std::vector<std::uint32_t>> schedule_adjustment(const AtlasContents& contents);

/// Where another tile lies in the frame of one, by their anchors.
Sim3 tile_from_other(const AtlasTile& tile, const AtlasTile& other);

/// Gives what the tiles of a link share.
using ReadShared = std::function<SharedLandmarks(const AtlasLink&)>;

/// Adjusts a tile of this index, see adjust_tile(), among its neighbours, and stores it; gives the
/// checksum of the new file.
std::string adjust_stored_tile(Atlas& atlas,
                               const AtlasContents& contents,
                               std::uint32_t tile,
                               const ReadShared& read_shared);

/// How the tiles of a link lie to each other as they are now, see fit_tiles(); as before where that
/// is not determined.
Sim3 refit_link(const Atlas& atlas,
                const AtlasContents& contents,
                const AtlasLink& link,
                const SharedLandmarks& shared);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An atlas as one map, for what takes a map.
//
//   const StoredMap whole = export_atlas(Atlas::open("building.atlas"));
//   save_map("building.wmap", whole);

#include "waymark/atlas/atlas.h"

namespace waymark {

/// All of an atlas as one map: a sub-map per part, the tiles of which lie where their anchors say
/// and share what links tie. Its settings are those of the first tile.
StoredMap export_atlas(const Atlas& atlas);

/// The map in a file, or all of the atlas in a folder. Throws InputError.
StoredMap load_map_or_atlas(const std::filesystem::path& path);

}  // namespace waymark

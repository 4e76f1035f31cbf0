// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "waymark/features/features.h"
#include "waymark/map/map.h"

namespace waymark {

/// What a place index has to know of the keyframes of a tile: the descriptors of each, by its id.
using TilePlaces = std::vector<std::vector<Descriptor>>;

/// Of all keyframes of a tile, whose ids have no gaps.
TilePlaces places_of_tile(const Map& tile);

/// Writes them as docs/atlas-format.md says. The same places give the same bytes. Throws
/// OutputError.
void save_places(const std::filesystem::path& path, const TilePlaces& places);

/// Reads what save_places() wrote. InputError for what is damaged, or has not as many keyframes.
TilePlaces load_places(const std::filesystem::path& path, std::uint32_t num_keyframes);

}  // namespace waymark

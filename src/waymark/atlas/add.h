// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Map files become part of an atlas.
//
//   Atlas atlas = Atlas::open_or_create("building.atlas");
//   const std::vector<std::filesystem::path> maps = {"monday.wmap", "tuesday.wmap"};
//   const AddedMaps added = add_maps(atlas, maps, kKeyframesPerTile, /*seed=*/0);
//   std::printf("%zu maps in %zu tiles, %zu links\n", added.num_added, added.num_tiles,
//   added.num_links);

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "waymark/atlas/atlas.h"

namespace waymark {

/// Keyframes of a tile, unless stated otherwise: what localizing opens at once.
inline constexpr std::size_t kKeyframesPerTile = 128;
inline constexpr std::size_t kMinKeyframesPerTile = 8;     ///< Fewer are no place.
inline constexpr std::size_t kMaxKeyframesPerTile = 2048;  ///< As many as a segment of places has.

/// By which a map file is known in an atlas: its SHA-256, or one of its own and its journal's.
std::string checksum_of_map(const std::filesystem::path& path);

/// What adding maps did.
struct AddedMaps {
  std::size_t num_added = 0;     ///< Others were there already.
  std::size_t num_tiles = 0;     ///< Of those that were added.
  std::size_t num_pairs = 0;     ///< Of tiles that were compared.
  std::size_t num_links = 0;     ///< Places of one map that another shows.
  std::size_t num_restored = 0;  ///< Damaged tiles of maps that were there.
};

/// Cuts map files into tiles, finds what they show of the tiles there and of each other, and puts
/// them where that says. The tiles that are there stay where they are among each other as far as
/// solve_anchors() keeps them. The same maps in any order give the same. Of a map that is there
/// already, tiles whose files are missing or damaged come back as they were cut. say: hears of each
/// step.
AddedMaps add_maps(Atlas& atlas,
                   std::span<const std::filesystem::path> maps,
                   std::size_t max_keyframes,
                   std::uint64_t seed,
                   const std::function<void(const std::string&)>& say = {});

}  // namespace waymark

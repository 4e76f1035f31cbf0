// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "waymark/atlas/atlas_database.h"
#include "waymark/atlas/tile_places.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/sha256.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDatabaseName = "atlas.db";
constexpr const char* kTileFolder = "tiles";
constexpr std::size_t kMaxAtlasFaults = 1000;

fs::path database_path(const fs::path& folder) { return folder / kDatabaseName; }

/// The order that sorts things by a key, and where each thing goes.
template <class Item, class Key>
std::vector<std::uint32_t> sort_by(std::vector<Item>& items, const Key& key) {
  std::vector<std::uint32_t> order(items.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](std::uint32_t x, std::uint32_t y) {
    return std::invoke(key, items[x]) < std::invoke(key, items[y]);
  });
  std::vector<Item> sorted;
  std::vector<std::uint32_t> targets(items.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    targets[order[i]] = i;
    sorted.push_back(std::move(items[order[i]]));
  }
  items = std::move(sorted);
  return targets;
}

/// A new file gets the name of what it holds.
std::string name_by_checksum(const fs::path& temporary, const char* ending) {
  const std::string checksum = sha256_of_file(temporary);
  std::error_code error;
  fs::rename(temporary, temporary.parent_path() / (checksum + ending), error);
  if (error) throw OutputError(temporary.string(), "cannot be renamed: " + error.message());
  return checksum;
}

/// In the folder of the tiles, so that it can be renamed; nobody else has it.
fs::path new_tile_file(const fs::path& folder) {
  std::string name = (folder / kTileFolder / "new-XXXXXX").string();
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0) throw OutputError(folder.string(), "cannot be written, expected a folder");
  ::fchmod(descriptor, S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH);
  ::close(descriptor);
  return name;
}

void check_pairs(const Atlas& atlas, const AtlasLink& link, std::vector<std::string>& faults) {
  const AtlasTile& a = atlas.contents().tiles[link.a];
  const AtlasTile& b = atlas.contents().tiles[link.b];
  const std::string where = fmt::format("link of {} and {}", a.origin, b.origin);
  const SharedLandmarks shared = atlas.read_shared(link);
  if (shared.size() != link.num_shared) faults.push_back(where + ": has not as many landmarks");
}

void check_tile(const Atlas& atlas, std::uint32_t index, std::vector<std::string>& faults) {
  const AtlasTile& tile = atlas.contents().tiles[index];
  const fs::path path = atlas.tile_path(tile.checksum);
  for (const std::string& fault : find_map_faults(path)) {
    faults.push_back(path.string() + ": " + fault);
  }
  if (sha256_of_file(path) != tile.checksum) {
    faults.push_back(path.string() + ": is another file than its name says");
  }
  const fs::path places = atlas.places_path(tile.places);
  if (sha256_of_file(places) != tile.places) {
    faults.push_back(places.string() + ": is another file than its name says");
  }
  load_places(places, tile.num_keyframes);
  atlas.load_tile(tile);
}

}  // namespace

void sort_contents(AtlasContents& contents) {
  const auto recording_at = sort_by(contents.recordings, &AtlasRecording::checksum);
  for (AtlasTile& tile : contents.tiles) tile.recording = recording_at[tile.recording];
  const auto tile_at = sort_by(contents.tiles, &AtlasTile::origin);
  for (AtlasLink& link : contents.links) {
    link.a = tile_at[link.a];
    link.b = tile_at[link.b];
    if (link.a < link.b) continue;
    std::swap(link.a, link.b);
    link.b_from_a = link.b_from_a.inverse();
  }
  sort_by(contents.links, [](const AtlasLink& link) { return std::pair(link.a, link.b); });
}

bool is_atlas(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored) && fs::exists(database_path(path), ignored);
}

Atlas Atlas::open(const fs::path& folder) {
  if (!is_atlas(folder)) {
    throw InputError(folder.string(), "is no atlas, expected a folder with atlas.db");
  }
  Atlas atlas(folder);
  const AtlasDatabase base(database_path(folder), /*is_writable=*/false);
  atlas.generation_ = base.generation();
  atlas.contents_ = base.read();
  return atlas;
}

Atlas Atlas::open_or_create(const fs::path& folder) {
  if (is_atlas(folder)) return open(folder);
  std::error_code ignored;
  if (fs::exists(folder, ignored) &&
      !(fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored))) {
    throw InputError(folder.string(), "is there and no atlas, expected one or a new folder");
  }
  make_output_folder(folder / kTileFolder);
  const fs::path temporary = folder / "atlas.db.new";
  AtlasDatabase::create(temporary);
  std::error_code error;
  fs::rename(temporary, database_path(folder), error);
  if (error) throw OutputError(folder.string(), "cannot be written: " + error.message());
  return open(folder);
}

Atlas Atlas::of_tiles(const fs::path& folder) {
  make_output_folder(folder / kTileFolder);
  return Atlas(folder);
}

fs::path Atlas::tile_path(const std::string& checksum) const {
  return folder_ / kTileFolder / (checksum + ".wmap");
}

fs::path Atlas::places_path(const std::string& checksum) const {
  return folder_ / kTileFolder / (checksum + ".places");
}

StoredMap Atlas::load_tile(const AtlasTile& tile) const {
  const fs::path path = tile_path(tile.checksum);
  StoredMap stored = load_map(path);
  const Map& map = *stored.map;
  const bool is_one = map.submaps().size() == 1 && map.submaps()[0].is_metric == tile.is_metric;
  if (!is_one || map.keyframes().size() != tile.num_keyframes ||
      map.keyframes().end_id().value != tile.num_keyframes ||
      map.landmarks().end_id().value != tile.num_landmarks) {
    throw InputError(path.string(), "is another tile than atlas.db says");
  }
  return stored;
}

SharedLandmarks Atlas::read_shared(const AtlasLink& link) const {
  const AtlasTile& a = contents_.tiles[link.a];
  const AtlasTile& b = contents_.tiles[link.b];
  const fs::path path = database_path(folder_);
  SharedLandmarks shared = AtlasDatabase(path, false).read_shared(a.origin, b.origin);
  for (const auto& [of_a, of_b] : shared) {
    if (of_a.value < a.num_landmarks && of_b.value < b.num_landmarks) continue;
    throw InputError(path.string(), "a link shares a landmark that is not there");
  }
  return shared;
}

std::string Atlas::store_tile(const StoredMap& tile) const {
  const fs::path temporary = new_tile_file(folder_);
  save_map(temporary, tile);
  return name_by_checksum(temporary, ".wmap");
}

std::string Atlas::store_places(const Map& tile) const {
  const fs::path temporary = new_tile_file(folder_);
  save_places(temporary, places_of_tile(tile));
  return name_by_checksum(temporary, ".places");
}

void Atlas::commit(const AtlasContents& contents, const std::vector<NewShared>& shared) {
  AtlasDatabase base(database_path(folder_), /*is_writable=*/true);
  generation_ = base.write(contents, shared, generation_);
  contents_ = base.read();
  remove_unused();
}

void Atlas::remove_unused() const {
  std::set<std::string> used;
  for (const AtlasTile& tile : contents_.tiles) {
    used.insert(tile.checksum + ".wmap");
    used.insert(tile.places + ".places");
  }
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / kTileFolder, ignored)) {
    const fs::path name = entry.path().filename();
    if (!is_sha256(name.stem().string()) || used.contains(name.string())) continue;
    fs::remove(entry.path(), ignored);
  }
}

std::vector<std::string> find_atlas_faults(const fs::path& folder) {
  std::vector<std::string> faults;
  const auto note = [&](const auto& look) {
    if (faults.size() >= kMaxAtlasFaults) return;
    try {
      look();
    } catch (const InputError& error) {
      faults.push_back(error.what());
    }
  };
  note([&] {
    const Atlas atlas = Atlas::open(folder);
    for (std::uint32_t i = 0; i < atlas.contents().tiles.size(); ++i) {
      note([&] { check_tile(atlas, i, faults); });
    }
    for (const AtlasLink& link : atlas.contents().links) {
      note([&] { check_pairs(atlas, link, faults); });
    }
  });
  faults.resize(std::min(faults.size(), kMaxAtlasFaults));
  return faults;
}

}  // namespace waymark

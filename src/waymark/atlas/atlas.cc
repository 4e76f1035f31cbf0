// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "waymark/atlas/atlas_database.h"
#include "waymark/atlas/tile_places.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/sha256.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDatabaseName = "atlas.db";
constexpr const char* kTileFolder = "tiles";
constexpr const char* kNewFiles = "new-";  // Folders of those who write, below that of the tiles.
constexpr std::size_t kMaxFileBytes = std::size_t{4} << 30;
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

std::string tile_name(const std::string& checksum) { return checksum + ".wmap"; }
std::string places_name(const std::string& checksum) { return checksum + ".places"; }

/// Of the files of the tiles.
std::set<std::string> names_of(const AtlasContents& contents) {
  std::set<std::string> names;
  for (const AtlasTile& tile : contents.tiles) {
    names.insert(tile_name(tile.checksum));
    names.insert(places_name(tile.places));
  }
  return names;
}

void move_file(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw OutputError(to.string(), "cannot be written: " + error.message());
}

/// What is wrong with a file as such.
std::optional<std::string> fault_of(const fs::path& path) {
  if (sha256_of_file(path) == path.stem()) return std::nullopt;
  return path.string() + ": is another file than its name says";
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
  const fs::path places = atlas.places_path(tile.places);
  for (const fs::path& file : {path, places}) {
    if (auto fault = fault_of(file)) faults.push_back(*std::move(fault));
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
  atlas.reload();
  return atlas;
}

Atlas Atlas::open_or_create(const fs::path& folder) {
  std::error_code ignored;
  // Looked for last: somebody may just have made it.
  if (fs::exists(folder, ignored) &&
      !(fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored)) && !is_atlas(folder)) {
    throw InputError(folder.string(), "is there and no atlas, expected one or a new folder");
  }
  make_output_folder(folder);
  AtlasDatabase::create(database_path(folder));
  remove_abandoned_scratch(folder / kTileFolder / kNewFiles);
  return open(folder);
}

Atlas Atlas::of_tiles(const fs::path& folder) {
  Atlas atlas(folder);
  atlas.has_state_ = false;
  return atlas;
}

fs::path Atlas::path_of(const std::string& name) const {
  std::error_code ignored;
  if (new_files_ && fs::exists(new_files_->path() / name, ignored))
    return new_files_->path() / name;
  return folder_ / kTileFolder / name;
}

fs::path Atlas::tile_path(const std::string& checksum) const {
  return path_of(tile_name(checksum));
}

fs::path Atlas::places_path(const std::string& checksum) const {
  return path_of(places_name(checksum));
}

bool Atlas::is_whole(const AtlasTile& tile) const {
  try {
    return !fault_of(tile_path(tile.checksum)) && !fault_of(places_path(tile.places));
  } catch (const InputError&) {
    return false;
  }
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

const fs::path& Atlas::new_files() {
  if (!new_files_) {
    make_output_folder(folder_ / kTileFolder);
    new_files_ = std::make_shared<ScratchFolder>(folder_ / kTileFolder / kNewFiles);
  }
  return new_files_->path();
}

/// A new file gets the name of what it holds.
std::string Atlas::keep(const fs::path& file, const char* ending) const {
  std::string checksum = sha256_of_file(file);
  const fs::path folder = has_state_ ? file.parent_path() : folder_ / kTileFolder;
  move_file(file, folder / (checksum + ending));
  return checksum;
}

std::string Atlas::store_tile(const StoredMap& tile) {
  const fs::path file = new_files() / "tile";
  save_map(file, tile);
  return keep(file, ".wmap");
}

std::string Atlas::store_places(const Map& tile) {
  const fs::path file = new_files() / "places";
  save_places(file, places_of_tile(tile));
  return keep(file, ".places");
}

void Atlas::store_file(const fs::path& path) {
  const std::string content = read_text_file(path, "a file of a tile", kMaxFileBytes);
  if (sha256(content) != path.stem()) {
    throw InputError(path.string(), "is another file than its name says");
  }
  write_file_atomically(new_files() / path.filename(), content);
}

bool Atlas::reload() {
  const AtlasDatabase base(database_path(folder_), /*is_writable=*/false);
  if (base.generation() == generation_) return false;
  contents_ = base.read();
  generation_ = base.generation();
  return true;
}

void Atlas::publish_files(const AtlasContents& contents) const {
  if (!new_files_) return;
  const fs::path folder = folder_ / kTileFolder;
  for (const std::string& name : names_of(contents)) {
    const fs::path file = path_of(name);
    if (file.parent_path() != folder) move_file(file, folder / name);
  }
  flush_folder(folder);
}

bool Atlas::commit(const AtlasChange& change) {
  {
    AtlasDatabase base(database_path(folder_), /*is_writable=*/true);
    const bool is_current = base.generation() == generation_;
    if (is_current) {
      publish_files(change.contents);
      base.write(change.contents, change.shared);
    }
    AtlasContents contents = base.read();
    const std::int64_t generation = base.generation();
    base.finish();
    contents_ = std::move(contents);
    generation_ = generation;
    if (!is_current) return false;
  }
  try {
    remove_unused();
  } catch (const std::runtime_error&) {
    // The state is there; what it does not need goes the next time.
  }
  return true;
}

void Atlas::change(const std::function<std::optional<AtlasChange>()>& plan) {
  while (true) {
    try {
      const std::optional<AtlasChange> planned = plan();
      if (!planned || commit(*planned)) return;
    } catch (const InputError&) {
      if (!reload()) throw;  // Else a file may have gone with the state that referred to it.
    }
  }
}

/// Nobody else writes meanwhile. What no state refers to yet is in the folder of its writer: a
/// file beside the others that none refers to is left over.
void Atlas::remove_unused() const {
  const AtlasDatabase base(database_path(folder_), /*is_writable=*/true);
  const std::set<std::string> used = names_of(base.read());
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

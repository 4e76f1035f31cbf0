// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/add.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "waymark/atlas/anchors.h"
#include "waymark/atlas/atlas_places.h"
#include "waymark/atlas/steps.h"
#include "waymark/base/sha256.h"

namespace waymark {
namespace {

bool has_recording(const AtlasContents& contents, const std::string& checksum) {
  return std::ranges::binary_search(contents.recordings, checksum, {}, &AtlasRecording::checksum);
}

using Say = std::function<void(const std::string&)>;

/// Places that tiles which are new have in common with others. Opens two tiles at a time.
std::vector<FoundLink> find_links(const Atlas& atlas,
                                  const AtlasContents& contents,
                                  const std::set<std::string>& new_tiles,
                                  std::uint64_t seed,
                                  AddedMaps& added,
                                  const Say& say) {
  const AtlasPlaces places(atlas, contents);
  std::vector<std::pair<std::uint32_t, std::vector<AlikeTile>>> alike;
  for (std::uint32_t i = 0; i < contents.tiles.size(); ++i) {
    if (!new_tiles.contains(contents.tiles[i].origin)) continue;
    const StoredMap tile = atlas.load_tile(contents.tiles[i]);
    alike.push_back({i, find_alike_tiles(contents, places, i, *tile.map, kMaxLinksSought)});
  }
  const std::vector<TilePair> pairs = choose_pairs(alike);
  say(fmt::format("{} pairs of tiles look alike", pairs.size()));
  added.num_pairs = pairs.size();
  std::vector<FoundLink> links;
  for (const TilePair& pair : pairs) {
    const StoredMap a = atlas.load_tile(contents.tiles[pair.a]);
    const StoredMap b = atlas.load_tile(contents.tiles[pair.b]);
    if (auto found = link_pair(contents, pair, *a.map, *b.map, seed)) {
      links.push_back(*std::move(found));
    }
  }
  say(fmt::format("{} of them show the same place", links.size()));
  return links;
}

}  // namespace

std::string checksum_of_map(const std::filesystem::path& path) {
  const std::string of_file = sha256_of_file(path);
  const std::filesystem::path journal = path.string() + ".journal";
  std::error_code ignored;
  if (!std::filesystem::exists(journal, ignored)) return of_file;
  return sha256(of_file + sha256_of_file(journal));
}

AddedMaps add_maps(Atlas& atlas,
                   std::span<const std::filesystem::path> maps,
                   std::size_t max_keyframes,
                   std::uint64_t seed,
                   const std::function<void(const std::string&)>& say) {
  const Say tell = say ? say : [](const std::string&) {};
  AddedMaps added;
  AtlasContents contents = atlas.contents();
  std::vector<NewShared> shared;
  std::uint32_t since = 0;
  for (const AtlasRecording& one : contents.recordings) since = std::max(since, one.since + 1);
  std::set<std::string> new_tiles;
  for (const std::filesystem::path& path : maps) {
    const std::string checksum = checksum_of_map(path);
    if (has_recording(contents, checksum)) {
      tell(path.string() + ": is there already");
      continue;
    }
    CutRecording cut =
        cut_recording(atlas, load_map(path), checksum, path.stem().string(), max_keyframes);
    for (AtlasRecording& one : cut.contents.recordings) one.since = since;
    for (const AtlasTile& tile : cut.contents.tiles) new_tiles.insert(tile.origin);
    tell(fmt::format("{}: {} tiles", path.string(), cut.contents.tiles.size()));
    append_contents(contents, cut.contents);
    std::ranges::move(cut.shared, std::back_inserter(shared));
    ++added.num_added;
  }
  if (added.num_added == 0) return added;
  added.num_tiles = new_tiles.size();
  for (FoundLink& found : find_links(atlas, contents, new_tiles, seed, added, tell)) {
    contents.links.push_back(found.link);
    shared.push_back(std::move(found.shared));
    ++added.num_links;
  }
  sort_contents(contents);
  solve_anchors(contents);
  atlas.commit(contents, shared);
  return added;
}

}  // namespace waymark

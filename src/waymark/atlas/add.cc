// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/add.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "waymark/atlas/anchors.h"
#include "waymark/atlas/atlas_places.h"
#include "waymark/atlas/steps.h"
#include "waymark/base/check.h"
#include "waymark/base/sha256.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

std::uint32_t find_recording(const AtlasContents& contents, const std::string& checksum) {
  const auto at =
      std::ranges::lower_bound(contents.recordings, checksum, {}, &AtlasRecording::checksum);
  const bool is_there = at != contents.recordings.end() && at->checksum == checksum;
  return static_cast<std::uint32_t>((is_there ? at : contents.recordings.end()) -
                                    contents.recordings.begin());
}

bool has_recording(const AtlasContents& contents, const std::string& checksum) {
  return find_recording(contents, checksum) < contents.recordings.size();
}

/// Origins of the tiles of a recording whose files are not what they should be.
std::set<std::string> find_damaged_tiles(const Atlas& atlas, const std::string& checksum) {
  std::set<std::string> damaged;
  const std::uint32_t recording = find_recording(atlas.contents(), checksum);
  for (const AtlasTile& tile : atlas.contents().tiles) {
    if (tile.recording == recording && !atlas.is_whole(tile)) damaged.insert(tile.origin);
  }
  return damaged;
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
  say(count_of(pairs.size(), "pair of tiles looks alike", "pairs of tiles look alike"));
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

/// Maps in tiles whose files are kept, and what they are for.
struct CutMaps {
  std::vector<CutRecording> recordings;
  std::set<std::string> damaged;  ///< Origins of tiles in the atlas that are to be made again.
};

CutMaps cut_maps(Atlas& atlas,
                 std::span<const std::filesystem::path> maps,
                 std::size_t max_keyframes,
                 const Say& say) {
  CutMaps cut;
  std::set<std::string> seen;
  for (const std::filesystem::path& path : maps) {
    const std::string checksum = checksum_of_map(path);
    const std::set<std::string> damaged = find_damaged_tiles(atlas, checksum);
    const bool is_there = has_recording(atlas.contents(), checksum);
    if (!seen.insert(checksum).second || (is_there && damaged.empty())) {
      say(path.string() + ": is there already");
      continue;
    }
    cut.recordings.push_back(
        cut_recording(atlas, load_map(path), checksum, path.stem().string(), max_keyframes));
    const AtlasContents& made = cut.recordings.back().contents;
    for (const std::string& origin : damaged) {
      if (std::ranges::binary_search(made.tiles, origin, {}, &AtlasTile::origin)) continue;
      throw InputError(path.string(),
                       "does not give the damaged tile " + origin +
                           " again, expected --keyframes as when it was added");
    }
    cut.damaged.insert(damaged.begin(), damaged.end());
    say(is_there ? fmt::format("{}: {} damaged tiles made again", path.string(), damaged.size())
                 : path.string() + ": " + count_of(made.tiles.size(), "tile"));
  }
  return cut;
}

/// What becomes of the atlas as it is now.
std::optional<AtlasChange> plan_change(
    const Atlas& atlas, const CutMaps& cut, std::uint64_t seed, AddedMaps& added, const Say& say) {
  added = {};
  AtlasChange change{atlas.contents(), {}};
  AtlasContents& contents = change.contents;
  std::uint32_t since = 0;
  for (const AtlasRecording& one : contents.recordings) since = std::max(since, one.since + 1);
  for (AtlasTile& tile : contents.tiles) {
    if (!cut.damaged.contains(tile.origin)) continue;
    tile.checksum = tile.origin;
    ++added.num_restored;
  }
  std::set<std::string> new_tiles;
  for (const CutRecording& one : cut.recordings) {
    AtlasContents more = one.contents;
    if (has_recording(contents, more.recordings[0].checksum)) continue;
    more.recordings[0].since = since;
    for (const AtlasTile& tile : more.tiles) new_tiles.insert(tile.origin);
    append_contents(contents, more);
    change.shared.insert(change.shared.end(), one.shared.begin(), one.shared.end());
    ++added.num_added;
  }
  if (added.num_added + added.num_restored == 0) return std::nullopt;
  added.num_tiles = new_tiles.size();
  if (new_tiles.empty()) return change;
  for (FoundLink& found : find_links(atlas, contents, new_tiles, seed, added, say)) {
    contents.links.push_back(found.link);
    change.shared.push_back(std::move(found.shared));
    ++added.num_links;
  }
  sort_contents(contents);
  solve_anchors(contents);
  return change;
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
  const CutMaps cut = cut_maps(atlas, maps, max_keyframes, tell);
  AddedMaps added;
  atlas.change([&] { return plan_change(atlas, cut, seed, added, tell); });
  return added;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas_places.h"

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/atlas/tile_places.h"
#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Per keyframe of a tile; some of them are of the same place.
constexpr std::size_t kNumAlike = 12;

bool is_of_one_map(const AtlasTile& a, const AtlasTile& b) {
  return a.recording == b.recording && a.submap == b.submap;
}

}  // namespace

std::vector<TileRange> divide_tiles(const AtlasContents& contents, std::size_t max_keyframes) {
  WAYMARK_CHECK(max_keyframes > 0);
  std::size_t all = 0;
  for (const AtlasTile& tile : contents.tiles) all += tile.num_keyframes;
  const std::size_t num_ranges =
      std::max<std::size_t>((all + max_keyframes - 1) / max_keyframes, 1);
  std::vector<TileRange> ranges;
  std::size_t before = 0;
  std::size_t in_range = 0;
  for (std::uint32_t i = 0; i < contents.tiles.size(); ++i) {
    const std::size_t count = contents.tiles[i].num_keyframes;
    const bool is_full = in_range + count > max_keyframes;
    if (ranges.empty() || is_full || before >= all * ranges.size() / num_ranges) {
      ranges.push_back({i, i});
      in_range = 0;
    }
    ranges.back().end = i + 1;
    in_range += count;
    before += count;
  }
  return ranges;
}

AtlasPlaces::AtlasPlaces(const Atlas& atlas, const AtlasContents& contents, const TileRange& range)
    : first_id_(contents.tiles.size(), 0) {
  std::uint32_t next = 0;
  const auto end = std::min(range.end, static_cast<std::uint32_t>(contents.tiles.size()));
  for (std::uint32_t i = range.begin; i < end; ++i) {
    const AtlasTile& tile = contents.tiles[i];
    if (next > UINT32_MAX / 2) throw InputError(atlas.folder().string(), "has too many keyframes");
    first_id_[i] = next;
    for (const auto& descriptors :
         load_places(atlas.places_path(tile.places), tile.num_keyframes)) {
      index_.add(KeyframeId{next++}, SubmapId{i}, descriptors);
    }
  }
}

std::vector<AtlasCandidate> AtlasPlaces::find(
    std::span<const Descriptor> descriptors,
    std::size_t max_candidates,
    const std::function<bool(std::uint32_t)>& is_excluded) const {
  PlaceQuery query{.max_candidates = max_candidates};
  if (is_excluded) {
    query.is_excluded = [&](const PlaceRow& row) { return is_excluded(row.submap.value); };
  }
  std::vector<AtlasCandidate> found;
  for (const PlaceCandidate& candidate : index_.find(descriptors, query)) {
    const std::uint32_t tile = candidate.submap.value;
    found.push_back(
        {tile, KeyframeId{candidate.keyframe.value - first_id_[tile]}, candidate.score});
  }
  return found;
}

std::vector<AlikeTile> find_alike_tiles(const AtlasContents& contents,
                                        const AtlasPlaces& places,
                                        std::uint32_t tile,
                                        const Map& map,
                                        std::size_t max_count) {
  // What each of the others has of each keyframe: its best score.
  std::map<std::uint32_t, std::map<KeyframeId, double>> votes;
  const auto is_excluded = [&](std::uint32_t other) {
    return is_of_one_map(contents.tiles[tile], contents.tiles[other]);
  };
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    for (const AtlasCandidate& candidate :
         places.find(keyframe.features->corner_descriptors(), kNumAlike, is_excluded)) {
      double& best = votes[candidate.tile][id];
      best = std::max(best, candidate.score);
    }
  });
  std::vector<AlikeTile> alike;
  for (const auto& [other, of_keyframes] : votes) {
    AlikeTile& one = alike.emplace_back();
    one.tile = other;
    std::vector<std::pair<double, KeyframeId>> ranked;
    for (const auto& [id, score] : of_keyframes) {
      one.score += score;
      ranked.push_back({-score, id});
    }
    std::ranges::sort(ranked);
    for (const auto& [score, id] : ranked) one.queries.push_back(id);
  }
  keep_best(alike, max_count);
  return alike;
}

void keep_best(std::vector<AlikeTile>& alike, std::size_t max_count) {
  std::ranges::stable_sort(alike, std::ranges::greater(), &AlikeTile::score);
  if (alike.size() > max_count) alike.resize(max_count);
}

}  // namespace waymark

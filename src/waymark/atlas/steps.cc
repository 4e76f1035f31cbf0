// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/steps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "waymark/atlas/link_tiles.h"
#include "waymark/atlas/partition.h"
#include "waymark/base/check.h"
#include "waymark/system/query_frames.h"

namespace waymark {
namespace {

/// What is known of a tile without opening it.
AtlasTile describe_tile(const PartitionTile& cut) {
  AtlasTile tile;
  const Map& map = cut.map;
  tile.submap = cut.submap.value;
  tile.num_keyframes = static_cast<std::uint32_t>(map.keyframes().size());
  tile.num_landmarks = map.landmarks().end_id().value;
  tile.is_metric = map.submaps()[0].is_metric;
  tile.pixel_angle_rad = middling_pixel_angle(map);
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    tile.centre += keyframe.rig_from_world.origin_in_source();
  });
  tile.centre /= static_cast<double>(tile.num_keyframes);
  double squares = 0.0;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    squares += (keyframe.rig_from_world.origin_in_source() - tile.centre).squaredNorm();
  });
  tile.radius = std::sqrt(squares / static_cast<double>(tile.num_keyframes));
  return tile;
}

KeyframeImages images_of(const StoredMap& stored, const PartitionTile& tile) {
  KeyframeImages images;
  for (std::uint32_t i = 0; i < tile.keyframes.size(); ++i) {
    const auto at = stored.images.find(tile.keyframes[i]);
    if (at != stored.images.end()) images.emplace(KeyframeId{i}, at->second);
  }
  return images;
}

/// The cameras of all keyframes must be known: places are compared through them.
void check_models(const Map& map, const std::string& name) {
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    for (const RigCamera& camera : keyframe.rig().cameras) {
      if (camera.camera->can_project()) continue;
      throw InputError(name, "has a camera of an unknown model, expected one that is known");
    }
  });
}

}  // namespace

CutRecording cut_recording(Atlas& atlas,
                           const StoredMap& stored,
                           const std::string& checksum,
                           const std::string& name,
                           std::size_t max_keyframes) {
  check_models(*stored.map, name);
  PartitionedMap cut = partition_map(*stored.map, max_keyframes);
  CutRecording result;
  AtlasContents& contents = result.contents;
  contents.recordings.push_back({checksum, name, 0});
  for (PartitionTile& part : cut.tiles) {
    AtlasTile& tile = contents.tiles.emplace_back(describe_tile(part));
    StoredMap file;
    file.map = part.map.freeze();
    file.settings = stored.settings;
    file.images = images_of(stored, part);
    tile.origin = tile.checksum = atlas.store_tile(file);
    tile.places = atlas.store_places(*file.map);
  }
  for (TileBorder& border : cut.borders) {
    AtlasLink link;
    link.a = static_cast<std::uint32_t>(border.a);
    link.b = static_cast<std::uint32_t>(border.b);
    link.is_border = true;
    link.num_shared = static_cast<std::uint32_t>(border.landmarks.size());
    contents.links.push_back(link);
    NewShared shared{contents.tiles[border.a].origin,
                     contents.tiles[border.b].origin,
                     std::move(border.landmarks)};
    if (shared.origin_b < shared.origin_a) {
      std::swap(shared.origin_a, shared.origin_b);
      for (auto& [a, b] : shared.landmarks) std::swap(a, b);
      std::ranges::sort(shared.landmarks);
    }
    result.shared.push_back(std::move(shared));
  }
  append_contents(contents, {});
  return result;
}

void append_contents(AtlasContents& contents, const AtlasContents& more) {
  const auto num_recordings = static_cast<std::uint32_t>(contents.recordings.size());
  const auto num_tiles = static_cast<std::uint32_t>(contents.tiles.size());
  contents.recordings.insert(
      contents.recordings.end(), more.recordings.begin(), more.recordings.end());
  for (AtlasTile tile : more.tiles) {
    tile.recording += num_recordings;
    contents.tiles.push_back(std::move(tile));
  }
  for (AtlasLink link : more.links) {
    link.a += num_tiles;
    link.b += num_tiles;
    contents.links.push_back(link);
  }
  sort_contents(contents);
  for (std::size_t i = 1; i < contents.tiles.size(); ++i) {
    if (contents.tiles[i - 1].origin != contents.tiles[i].origin) continue;
    const auto name = [&](std::size_t k) {
      return contents.recordings[contents.tiles[k].recording].name;
    };
    throw InputError(name(i), "has a tile that is there already, of " + name(i - 1));
  }
}

std::vector<TilePair> choose_pairs(
    const std::vector<std::pair<std::uint32_t, std::vector<AlikeTile>>>& by_tile) {
  std::map<std::uint32_t, std::vector<AlikeTile>> best;
  for (const auto& [tile, alike] : by_tile) {
    best[tile].insert(best[tile].end(), alike.begin(), alike.end());
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, TilePair> pairs;
  for (auto& [tile, alike] : best) {
    keep_best(alike, kMaxLinksSought);
    for (const AlikeTile& other : alike) {
      const bool is_later = tile > other.tile;
      const auto key = std::minmax({tile, other.tile});
      // Where each looks like the other, the later one is looked for in the earlier.
      if (!is_later && pairs.contains(key)) continue;
      pairs[key] = {other.tile, tile, other.queries};
    }
  }
  std::vector<TilePair> chosen;
  for (auto& [key, pair] : pairs) chosen.push_back(std::move(pair));
  return chosen;
}

std::optional<FoundLink> link_pair(const AtlasContents& contents,
                                   const TilePair& pair,
                                   const Map& a,
                                   const Map& b,
                                   std::uint64_t seed) {
  std::optional<SharedLandmarks> landmarks = match_tiles(a, b, pair.queries, seed);
  if (!landmarks) return std::nullopt;
  const std::optional<Sim3> b_from_a = fit_tiles(a, b, *landmarks);
  if (!b_from_a) return std::nullopt;
  FoundLink found;
  found.link = {.a = pair.a, .b = pair.b, .is_border = false, .b_from_a = *b_from_a};
  found.link.num_shared = static_cast<std::uint32_t>(landmarks->size());
  if (pair.a > pair.b) {
    std::swap(found.link.a, found.link.b);
    found.link.b_from_a = b_from_a->inverse();
    for (auto& [of_a, of_b] : *landmarks) std::swap(of_a, of_b);
    std::ranges::sort(*landmarks);
  }
  found.shared = {contents.tiles[found.link.a].origin,
                  contents.tiles[found.link.b].origin,
                  *std::move(landmarks)};
  return found;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/adjust_tiles.h"

#include <algorithm>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "waymark/atlas/anchors.h"
#include "waymark/atlas/link_tiles.h"
#include "waymark/map/correction.h"
#include "waymark/mapping/bundle_window.h"

namespace waymark {
namespace {

/// What moves, and what of the rest sees the same.
BundleWindow window_of(const JoinedTiles& joined, std::uint32_t num_moving) {
  BundleWindow window;
  std::set<LandmarkId> landmarks;
  joined.map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (id.value >= num_moving) return;
    window.moving.push_back(id);
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (landmark.is_valid()) landmarks.insert(landmark);
    }
  });
  std::set<KeyframeId> fixed;
  for (const LandmarkId id : landmarks) {
    const Landmark& landmark = joined.map.landmarks().at(id);
    if (!is_supported(joined.map, landmark)) continue;
    window.landmarks.push_back(id);
    for (const Observation& observation : landmark.observations) {
      if (observation.keyframe.value >= num_moving) fixed.insert(observation.keyframe);
    }
  }
  window.fixed.assign(fixed.begin(), fixed.end());
  return window;
}

/// A tile and the links it is part of.
struct TileNeighbourhood {
  std::vector<std::uint32_t> tiles;  ///< It and its neighbours.
  std::vector<TileSeam> seams;
};

TileNeighbourhood neighbourhood_of(const AtlasContents& contents,
                                   std::uint32_t tile,
                                   const ReadShared& read_shared) {
  TileNeighbourhood around{{tile}, {}};
  for (const AtlasLink& link : contents.links) {
    if (link.a != tile && link.b != tile) continue;
    TileSeam seam{0, static_cast<std::uint32_t>(around.tiles.size()), read_shared(link)};
    if (link.b == tile) std::swap(seam.a, seam.b);
    around.tiles.push_back(link.a == tile ? link.b : link.a);
    around.seams.push_back(std::move(seam));
  }
  return around;
}

}  // namespace

std::string adjust_stored_tile(Atlas& atlas,
                               const AtlasContents& contents,
                               std::uint32_t index,
                               const ReadShared& read_shared) {
  const TileNeighbourhood around = neighbourhood_of(contents, index, read_shared);
  const AtlasTile& tile = contents.tiles[index];
  const bool is_in_metres = frames_in_metres(contents)[tile.frame];
  // What stereo and depth measure holds in metres only.
  const double metres = is_in_metres ? tile.atlas_from_tile.scale : 1.0;
  const Sim3 joined_from_tile({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), metres);
  std::vector<StoredMap> files;
  std::vector<PlacedTile> placed;
  for (const std::uint32_t other : around.tiles) {
    files.push_back(atlas.load_tile(contents.tiles[other]));
    placed.push_back({files.back().map.get(),
                      joined_from_tile * tile_from_other(tile, contents.tiles[other]),
                      is_in_metres});
  }
  files[0].map = adjust_tile(placed, around.seams).freeze();
  return atlas.store_tile(files[0]);
}

Sim3 refit_link(const Atlas& atlas,
                const AtlasContents& contents,
                const AtlasLink& link,
                const SharedLandmarks& shared) {
  const StoredMap a = atlas.load_tile(contents.tiles[link.a]);
  const StoredMap b = atlas.load_tile(contents.tiles[link.b]);
  return fit_tiles(*a.map, *b.map, shared).value_or(link.b_from_a);
}

Sim3 tile_from_other(const AtlasTile& tile, const AtlasTile& other) {
  return tile.atlas_from_tile.inverse() * other.atlas_from_tile;
}

Map adjust_tile(std::span<const PlacedTile> tiles, std::span<const TileSeam> seams) {
  Map adjusted = Map::thaw(*tiles[0].map);
  const JoinedTiles joined = join_tiles(tiles, seams);
  const std::uint32_t num_moving = adjusted.keyframes().end_id().value;
  const BundleWindow window = window_of(joined, num_moving);
  if (window.fixed.empty() || window.moving.empty()) return adjusted;
  const WindowAdjustment found =
      compute_adjustment(joined.map,
                         window,
                         {.num_rounds = 2,
                          .max_iterations_per_round = 20,
                          .num_threads = std::thread::hardware_concurrency()});
  MapCorrection correction;
  const double metres = tiles[0].joined_from_tile.scale;
  for (MapCorrection::KeyframeMove move : found.correction.keyframes) {
    move.rig_from_world.translation /= metres;
    correction.keyframes.push_back(move);
  }
  const auto& moves = found.correction.landmarks;
  adjusted.landmarks().for_each([&](LandmarkId id, const Landmark&) {
    const LandmarkId survivor = joined.map.resolve(id);
    const auto at =
        std::ranges::lower_bound(moves, survivor, {}, &MapCorrection::LandmarkMove::landmark);
    if (at == moves.end() || at->landmark != survivor) return;
    correction.landmarks.push_back({id, at->position_in_world / metres});
  });
  apply_correction(adjusted, correction);
  return adjusted;
}

std::vector<std::vector<std::uint32_t>> schedule_adjustment(const AtlasContents& contents) {
  std::vector<std::vector<std::uint32_t>> neighbours(contents.tiles.size());
  std::set<std::uint32_t> frames;
  for (const AtlasLink& link : contents.links) {
    neighbours[link.a].push_back(link.b);
    neighbours[link.b].push_back(link.a);
    if (!link.is_border) frames.insert(contents.tiles[link.a].frame);
  }
  std::vector<std::optional<std::size_t>> group_of(contents.tiles.size());
  std::vector<std::vector<std::uint32_t>> groups;
  for (std::uint32_t i = 0; i < contents.tiles.size(); ++i) {
    if (!frames.contains(contents.tiles[i].frame)) continue;
    std::set<std::size_t> taken;
    for (const std::uint32_t other : neighbours[i]) {
      if (group_of[other]) taken.insert(*group_of[other]);
    }
    std::size_t group = 0;
    while (taken.contains(group)) ++group;
    group_of[i] = group;
    if (group == groups.size()) groups.emplace_back();
    groups[group].push_back(i);
  }
  return groups;
}

}  // namespace waymark

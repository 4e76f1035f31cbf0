// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/join_tiles.h"

#include <algorithm>
#include <set>
#include <utility>

#include "waymark/map/align.h"
#include "waymark/map/parts.h"
#include "waymark/mapping/appearance.h"

namespace waymark {
namespace {

/// A keyframe that sees a landmark; else the root of the tile.
KeyframeId observer_of(const Map& map, LandmarkId id, std::uint32_t first_keyframe) {
  const Landmark* const landmark = map.landmarks().find(id);
  if (landmark && !landmark->observations.empty()) return landmark->observations.front().keyframe;
  return KeyframeId{first_keyframe};
}

void join_at(JoinedTiles& joined, const TileSeam& seam) {
  Map& map = joined.map;
  LandmarkId of_a, of_b;
  if (!seam.landmarks.empty()) {
    of_a.value = joined.first_landmark[seam.a] + seam.landmarks.front().first.value;
    of_b.value = joined.first_landmark[seam.b] + seam.landmarks.front().second.value;
  }
  KeyframeId child = observer_of(map, of_b, joined.first_keyframe[seam.b]);
  KeyframeId parent = observer_of(map, of_a, joined.first_keyframe[seam.a]);
  const SubmapId of_child = map.keyframes().at(child).submap;
  const SubmapId of_parent = map.keyframes().at(parent).submap;
  if (of_child == of_parent) return;
  if (of_child < of_parent) std::swap(child, parent);
  map.join_submaps(child, parent);
}

void merge_at(JoinedTiles& joined, const TileSeam& seam, std::set<LandmarkId>& changed) {
  Map& map = joined.map;
  for (const auto& [in_a, in_b] : seam.landmarks) {
    const LandmarkId a = map.resolve(LandmarkId{joined.first_landmark[seam.a] + in_a.value});
    const LandmarkId b = map.resolve(LandmarkId{joined.first_landmark[seam.b] + in_b.value});
    if (!a.is_valid() || !b.is_valid() || a == b) continue;
    map.merge_landmarks(std::min(a, b), std::max(a, b));
    changed.insert(std::min(a, b));
  }
}

}  // namespace

JoinedTiles join_tiles(std::span<const PlacedTile> tiles, std::span<const TileSeam> seams) {
  JoinedTiles joined;
  MapParts parts;
  parts.end_keyframe = KeyframeId{0};
  parts.end_landmark = LandmarkId{0};
  for (const PlacedTile& tile : tiles) {
    joined.first_keyframe.push_back(parts.end_keyframe.value);
    joined.first_landmark.push_back(parts.end_landmark.value);
    Map moved = Map::thaw(*tile.map);
    if (tile.is_in_metres) {
      moved = put_into_metres(std::move(moved), SubmapId{0}, tile.joined_from_tile);
    } else {
      transform_submap(moved, SubmapId{0}, tile.joined_from_tile);
    }
    append_parts(moved, parts);
  }
  joined.map = Map::restore(std::move(parts));
  for (const TileSeam& seam : seams) join_at(joined, seam);
  std::set<LandmarkId> changed;
  for (const TileSeam& seam : seams) merge_at(joined, seam, changed);
  for (const LandmarkId id : changed) {
    const Landmark* const landmark = joined.map.landmarks().find(id);
    if (!landmark || landmark->observations.empty()) continue;
    joined.map.set_appearance(id, describe_landmark(joined.map, id));
  }
  return joined;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/partition.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Tiles that share fewer landmarks need no border, unless one would be alone.
constexpr std::size_t kMinShared = 15;

struct Placed {
  KeyframeId id;
  Eigen::Vector3d position;
};

Eigen::Vector3d widest_direction(const std::vector<Placed>& keyframes) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Placed& placed : keyframes) mean += placed.position;
  mean /= static_cast<double>(keyframes.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Placed& placed : keyframes) {
    scatter += (placed.position - mean) * (placed.position - mean).transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
}

/// Into parts of nearly equal size; each ascending.
void divide(std::vector<Placed> keyframes,
            std::size_t num_parts,
            std::vector<std::vector<KeyframeId>>& parts) {
  if (num_parts <= 1) {
    std::vector<KeyframeId>& part = parts.emplace_back();
    for (const Placed& placed : keyframes) part.push_back(placed.id);
    std::ranges::sort(part);
    return;
  }
  const Eigen::Vector3d direction = widest_direction(keyframes);
  std::ranges::sort(keyframes, {}, [&](const Placed& placed) {
    return std::pair(placed.position.dot(direction), placed.id);
  });
  const std::size_t num_left = num_parts / 2;
  const auto middle =
      keyframes.begin() + static_cast<std::ptrdiff_t>(keyframes.size() * num_left / num_parts);
  divide({keyframes.begin(), middle}, num_left, parts);
  divide({middle, keyframes.end()}, num_parts - num_left, parts);
}

std::vector<std::vector<KeyframeId>> divide_submap(const Map& map,
                                                   SubmapId submap,
                                                   std::size_t max_keyframes) {
  std::vector<Placed> keyframes;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    keyframes.push_back({id, keyframe.rig_from_world.origin_in_source()});
  });
  std::vector<std::vector<KeyframeId>> parts;
  const std::size_t num_parts = (keyframes.size() + max_keyframes - 1) / max_keyframes;
  if (num_parts > 0) divide(std::move(keyframes), num_parts, parts);
  return parts;
}

/// Place of an id in an ascending list, as an id of the tile; invalid where it is not there.
template <class Id>
Id renumbered(const std::vector<Id>& ids, Id id) {
  const auto at = std::ranges::lower_bound(ids, id);
  if (at == ids.end() || *at != id) return {};
  return Id{static_cast<std::uint32_t>(at - ids.begin())};
}

/// The parent of each keyframe in the tree of the strongest covisibility (Prim 1957) that hangs
/// below the first one; what shares nothing with the rest hangs below the nearest.
std::vector<KeyframeId> spanning_tree(const Map& map, const std::vector<KeyframeId>& members) {
  std::vector<KeyframeId> parents(members.size());
  std::vector<std::uint32_t> strength(members.size(), 0);
  std::vector<double> distance(members.size(), std::numeric_limits<double>::infinity());
  std::vector<KeyframeId> nearest(members.size());
  std::vector<bool> is_in(members.size(), false);
  std::size_t next = 0;
  for (std::size_t count = 1; count <= members.size(); ++count) {
    is_in[next] = true;
    if (strength[next] == 0) parents[next] = nearest[next];
    const KeyframeId added{static_cast<std::uint32_t>(next)};
    for (const CovisibilityEdge& edge : map.covisible(members[next])) {
      const KeyframeId other = renumbered(members, edge.keyframe);
      if (!other.is_valid() || is_in[other.value]) continue;
      if (edge.num_shared <= strength[other.value]) continue;
      strength[other.value] = edge.num_shared;
      parents[other.value] = added;
    }
    const Rigid3& pose = map.keyframes().at(members[next]).rig_from_world;
    std::size_t best = members.size();
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (is_in[i]) continue;
      const double away = (map.keyframes().at(members[i]).rig_from_world.origin_in_source() -
                           pose.origin_in_source())
                              .norm();
      if (away < distance[i]) distance[i] = away, nearest[i] = added;
      const auto rank = [&](std::size_t k) { return std::tuple(strength[k], -distance[k]); };
      if (best == members.size() || rank(i) > rank(best)) best = i;
    }
    next = best;
  }
  return parents;
}

std::vector<LandmarkId> seen_by_all(const Map& map, const std::vector<KeyframeId>& members) {
  std::vector<LandmarkId> landmarks;
  for (const KeyframeId id : members) {
    for (const LandmarkId landmark : map.keyframes().at(id).landmarks) {
      if (landmark.is_valid()) landmarks.push_back(landmark);
    }
  }
  std::ranges::sort(landmarks);
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  return landmarks;
}

void add_keyframes(const Map& map, const PartitionTile& tile, MapParts& parts) {
  const std::vector<KeyframeId> parents = spanning_tree(map, tile.keyframes);
  for (std::uint32_t i = 0; i < tile.keyframes.size(); ++i) {
    Keyframe keyframe = map.keyframes().at(tile.keyframes[i]);
    keyframe.submap = SubmapId{0};
    keyframe.parent = parents[i];
    for (LandmarkId& landmark : keyframe.landmarks) {
      if (landmark.is_valid()) landmark = renumbered(tile.landmarks, landmark);
    }
    parts.keyframes.push_back({KeyframeId{i}, std::move(keyframe)});
  }
  parts.end_keyframe = KeyframeId{static_cast<std::uint32_t>(tile.keyframes.size())};
}

void add_landmarks(const Map& map, const PartitionTile& tile, MapParts& parts) {
  for (std::uint32_t i = 0; i < tile.landmarks.size(); ++i) {
    Landmark landmark = map.landmarks().at(tile.landmarks[i]);
    landmark.submap = SubmapId{0};
    const KeyframeId reference = renumbered(tile.keyframes, landmark.reference);
    KeyframeId first;
    for (const Observation& observation : landmark.observations) {
      if (!first.is_valid()) first = renumbered(tile.keyframes, observation.keyframe);
    }
    const bool is_held = reference.is_valid() && is_observed_by(landmark, landmark.reference);
    landmark.reference = is_held ? reference : first;
    landmark.observations.clear();
    parts.landmarks.push_back({LandmarkId{i}, std::move(landmark)});
  }
  parts.end_landmark = LandmarkId{static_cast<std::uint32_t>(tile.landmarks.size())};
}

void add_markers(const Map& map, const PartitionTile& tile, MapParts& parts) {
  for (MapMarker marker : map.markers()) {
    const KeyframeId reference = map.resolve(marker.reference);
    const KeyframeId inside = renumbered(tile.keyframes, reference);
    if (!inside.is_valid()) continue;
    const Keyframe& keyframe = map.keyframes().at(reference);
    marker.marker_from_reference =
        (keyframe.rig_from_world * map.world_from_marker(marker)).inverse();
    marker.reference = inside;
    marker.reference_scale = keyframe.applied_scale;
    parts.markers.push_back(marker);
  }
}

PartitionTile cut_tile(const Map& map, SubmapId submap, std::vector<KeyframeId> members) {
  PartitionTile tile;
  tile.submap = submap;
  tile.keyframes = std::move(members);
  tile.landmarks = seen_by_all(map, tile.keyframes);
  MapParts parts;
  parts.submaps.push_back({map.submaps()[submap.value].is_metric, KeyframeId{0}, SubmapId{}});
  add_keyframes(map, tile, parts);
  add_landmarks(map, tile, parts);
  add_markers(map, tile, parts);
  for (LoopEdge edge : map.measured_loop_edges()) {
    edge.from = renumbered(tile.keyframes, edge.from);
    edge.to = renumbered(tile.keyframes, edge.to);
    if (edge.from.is_valid() && edge.to.is_valid()) parts.loop_edges.push_back(edge);
  }
  tile.map = Map::restore(std::move(parts));
  return tile;
}

using BorderMap = std::map<std::pair<std::size_t, std::size_t>, SharedLandmarks>;

BorderMap find_shared(const std::vector<PartitionTile>& tiles) {
  std::map<LandmarkId, std::vector<std::pair<std::size_t, LandmarkId>>> places;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    for (std::uint32_t k = 0; k < tiles[i].landmarks.size(); ++k) {
      places[tiles[i].landmarks[k]].push_back({i, LandmarkId{k}});
    }
  }
  BorderMap shared;
  for (const auto& [id, in_tiles] : places) {
    for (std::size_t a = 0; a < in_tiles.size(); ++a) {
      for (std::size_t b = a + 1; b < in_tiles.size(); ++b) {
        shared[{in_tiles[a].first, in_tiles[b].first}].push_back(
            {in_tiles[a].second, in_tiles[b].second});
      }
    }
  }
  return shared;
}

/// Numbers of groups, joined little by little (Tarjan 1975).
class Groups {
 public:
  explicit Groups(std::size_t count) : above_(count) { std::iota(above_.begin(), above_.end(), 0); }
  std::size_t of(std::size_t i) const {
    while (above_[i] != i) i = above_[i];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    const auto [first, second] = std::minmax({of(a), of(b)});
    above_[second] = first;
  }

 private:
  std::vector<std::size_t> above_;
};

/// Those across which much is shared; where that leaves a part of a sub-map alone, the best there
/// is.
std::vector<TileBorder> choose_borders(const std::vector<PartitionTile>& tiles) {
  BorderMap shared = find_shared(tiles);
  Groups groups(tiles.size());
  std::vector<TileBorder> borders;
  for (auto& [pair, landmarks] : shared) {
    if (landmarks.size() < kMinShared) continue;
    groups.join(pair.first, pair.second);
    borders.push_back({pair.first, pair.second, std::move(landmarks)});
  }
  for (std::size_t b = 1; b < tiles.size(); ++b) {
    std::pair<std::size_t, std::size_t> best{0, b};  // How much they share, and the other.
    for (std::size_t a = 0; a < b; ++a) {
      if (tiles[a].submap != tiles[b].submap || groups.of(a) == groups.of(b)) continue;
      const auto at = shared.find({a, b});
      best = std::max(best, {at == shared.end() ? 0 : at->second.size(), a}, [&](auto x, auto y) {
        return y.second != b && (x.second == b || x.first <= y.first);
      });
    }
    if (best.second == b) continue;
    groups.join(best.second, b);
    borders.push_back({best.second, b, std::move(shared[{best.second, b}])});
  }
  std::ranges::sort(
      borders, {}, [](const TileBorder& border) { return std::pair(border.a, border.b); });
  return borders;
}

}  // namespace

PartitionedMap partition_map(const Map& map, std::size_t max_keyframes) {
  WAYMARK_CHECK(max_keyframes > 0);
  PartitionedMap cut;
  for (std::uint32_t i = 0; i < map.submaps().size(); ++i) {
    for (std::vector<KeyframeId>& members : divide_submap(map, SubmapId{i}, max_keyframes)) {
      cut.tiles.push_back(cut_tile(map, SubmapId{i}, std::move(members)));
    }
  }
  cut.borders = choose_borders(cut.tiles);
  return cut;
}

}  // namespace waymark

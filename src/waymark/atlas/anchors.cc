// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/anchors.h"

#include <algorithm>
#include <map>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "waymark/optimize/pose_graph.h"

namespace waymark {
namespace {

/// How well the landmarks that two tiles share say how these lie to each other, in parts of how far
/// apart their middles are: tiles bend.
constexpr double kSigma = 0.01;

/// A tile's frame with its origin in the middle of its rigs, where links hold it.
Sim3 middle_from_tile(const AtlasTile& tile) {
  return Sim3(Rigid3{Eigen::Quaterniond::Identity(), -tile.centre});
}

/// A link as seen from one of its tiles.
struct LinkedTile {
  bool is_border = false;
  std::uint32_t num_shared = 0;
  std::uint32_t from = 0;
  std::uint32_t tile = 0;
  Sim3 tile_from_from;

  /// Borders before places that were recognised, what shares more first.
  auto rank() const {
    return std::tuple(is_border, num_shared, -std::int64_t{from}, -std::int64_t{tile});
  }
  bool operator<(const LinkedTile& other) const { return rank() < other.rank(); }
};

using LinkedTiles = std::vector<std::vector<LinkedTile>>;

LinkedTiles list_neighbours(const AtlasContents& contents) {
  LinkedTiles neighbours(contents.tiles.size());
  for (const AtlasLink& link : contents.links) {
    neighbours[link.a].push_back({link.is_border, link.num_shared, link.a, link.b, link.b_from_a});
    neighbours[link.b].push_back(
        {link.is_border, link.num_shared, link.b, link.a, link.b_from_a.inverse()});
  }
  return neighbours;
}

/// The tiles connected with the first, which comes first; each is put where the strongest links say
/// (a spanning tree; Prim 1957).
std::vector<std::uint32_t> gather_part(AtlasContents& contents,
                                       const LinkedTiles& neighbours,
                                       std::uint32_t first,
                                       std::vector<bool>& is_done) {
  std::vector<std::uint32_t> part;
  std::priority_queue<LinkedTile> front;
  const auto take = [&](std::uint32_t tile, const Sim3& atlas_from_tile) {
    contents.tiles[tile].atlas_from_tile = atlas_from_tile;
    is_done[tile] = true;
    part.push_back(tile);
    for (const LinkedTile& neighbour : neighbours[tile]) front.push(neighbour);
  };
  take(first, Sim3());
  while (!front.empty()) {
    const LinkedTile next = front.top();
    front.pop();
    if (is_done[next.tile]) continue;
    take(next.tile, contents.tiles[next.from].atlas_from_tile * next.tile_from_from.inverse());
  }
  return part;
}

PoseGraphEdge edge_of(const AtlasContents& contents, const AtlasLink& link) {
  const AtlasTile& a = contents.tiles[link.a];
  const AtlasTile& b = contents.tiles[link.b];
  PoseGraphEdge edge;
  edge.to_from_from = middle_from_tile(b) * link.b_from_a * middle_from_tile(a).inverse();
  const double apart = std::max(edge.to_from_from.translation.norm(), b.radius);
  edge.sigma_translation = kSigma * std::max(apart, 1e-9);
  edge.sigma_rotation_rad = kSigma;
  edge.sigma_log_scale = kSigma;
  edge.is_robust = !link.is_border;
  return edge;
}

/// The same node, where it is, with lengths of the world.
Sim3 in_units_of_world(const Sim3& node_from_world) {
  return {node_from_world.rotation, node_from_world.translation / node_from_world.scale, 1.0};
}

/// A part begins with a tile in metres if it has one.
void solve_part(AtlasContents& contents,
                const std::vector<std::uint32_t>& part,
                const std::vector<AtlasLink>& links) {
  const auto is_metric = [&](std::uint32_t tile) { return contents.tiles[tile].is_metric; };
  const bool has_metres = is_metric(part[0]);
  const bool is_all_metric = std::ranges::all_of(part, is_metric);
  // A tree contradicts itself nowhere, unless a way between two in metres goes by others.
  if (links.size() < part.size() && (!has_metres || is_all_metric)) return;
  PoseGraph graph;
  graph.is_scale_free = !is_all_metric;
  std::map<std::uint32_t, std::uint32_t> node_of;
  for (const std::uint32_t tile : part) {
    node_of.emplace(tile, static_cast<std::uint32_t>(graph.node_from_world.size()));
    const Sim3 node_from_world =
        middle_from_tile(contents.tiles[tile]) * contents.tiles[tile].atlas_from_tile.inverse();
    graph.keeps_scale.push_back(is_metric(tile));
    graph.node_from_world.push_back(
        is_metric(tile) && !is_all_metric ? in_units_of_world(node_from_world) : node_from_world);
    graph.is_fixed.push_back(tile == part[0]);
  }
  for (const AtlasLink& link : links) {
    PoseGraphEdge& edge = graph.edges.emplace_back(edge_of(contents, link));
    edge.from = node_of.at(link.a);
    edge.to = node_of.at(link.b);
  }
  optimize_pose_graph(graph, {});
  for (const std::uint32_t tile : part) {
    if (tile == part[0]) continue;
    contents.tiles[tile].atlas_from_tile =
        graph.node_from_world[node_of.at(tile)].inverse() * middle_from_tile(contents.tiles[tile]);
  }
}

}  // namespace

void solve_anchors(AtlasContents& contents) {
  const auto count = static_cast<std::uint32_t>(contents.tiles.size());
  std::vector<std::uint32_t> order(count);
  for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
  std::ranges::stable_sort(order, {}, [&](std::uint32_t tile) {
    const AtlasRecording& recording = contents.recordings[contents.tiles[tile].recording];
    return std::tuple(!contents.tiles[tile].is_metric, recording.since, recording.checksum);
  });
  const LinkedTiles neighbours = list_neighbours(contents);
  std::vector<bool> is_done(count, false);
  std::vector<std::vector<std::uint32_t>> parts;
  for (const std::uint32_t first : order) {
    if (is_done[first]) continue;
    parts.push_back(gather_part(contents, neighbours, first, is_done));
    for (const std::uint32_t tile : parts.back()) {
      contents.tiles[tile].frame = static_cast<std::uint32_t>(parts.size() - 1);
    }
  }
  std::vector<std::vector<AtlasLink>> links(parts.size());
  for (const AtlasLink& link : contents.links) {
    links[contents.tiles[link.a].frame].push_back(link);
  }
  for (std::size_t i = 0; i < parts.size(); ++i) solve_part(contents, parts[i], links[i]);
}

std::vector<bool> frames_in_metres(const AtlasContents& contents) {
  std::vector<bool> is_in_metres(contents.tiles.size(), false);
  for (const AtlasTile& tile : contents.tiles) {
    if (tile.is_metric) is_in_metres[tile.frame] = true;
  }
  return is_in_metres;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/place_islands.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "waymark/optimize/pose_graph_solver.h"
#include "waymark/optimize/trusted_ways.h"

namespace waymark {
namespace {

/// Of the residual that is expected.
constexpr double kStillAgrees = 2.0;

class IslandPlacer {
 public:
  IslandPlacer(PoseGraph& graph, std::size_t first_tie, const IslandOptions& options)
      : graph_(graph),
        first_tie_(first_tie),
        options_(options),
        island_(graph.node_from_world.size()),
        is_trusted_(graph.edges.size(), 0),
        is_believed_(graph.edges.size(), 0),
        contradicts_(graph.edges.size(), 0) {
    std::fill_n(is_trusted_.begin(), first_tie, std::uint8_t{1});
    for (const std::size_t tie : options.believed) is_believed_.at(tie) = 1;
    find_islands();
  }

  IslandTies place() {
    const auto fixed = std::ranges::find(graph_.is_fixed, std::uint8_t{1});
    const auto first = fixed == graph_.is_fixed.end()
                           ? std::size_t{0}
                           : static_cast<std::size_t>(fixed - graph_.is_fixed.begin());
    is_placed_.assign(island_.size(), 0);
    is_placed_[island_[first]] = 1;
    while (const std::optional<Placement> next = choose_next()) take(*next);
    IslandTies ties;
    for (std::size_t i = first_tie_; i < is_believed_.size(); ++i) {
      if (is_believed_[i]) ties.believed.push_back(i);
      if (contradicts_[i]) ties.contradicting.push_back(i);
    }
    return ties;
  }

 private:
  /// An island as a tie has it.
  struct Placement {
    std::uint32_t island = 0;
    std::size_t tie = 0;
    std::vector<std::size_t> agreeing;  ///< Ties, itself among them.
    std::size_t num_places = 0;
  };

  /// Numbers islands by their least node.
  void find_islands() {
    std::iota(island_.begin(), island_.end(), 0u);
    const auto top_of = [&](std::uint32_t node) {
      while (island_[node] != node) node = island_[node] = island_[island_[node]];
      return node;
    };
    for (std::size_t i = 0; i < first_tie_; ++i) {
      if (!is_usable(graph_.edges[i], graph_.node_from_world)) continue;
      const std::uint32_t a = top_of(graph_.edges[i].from);
      const std::uint32_t b = top_of(graph_.edges[i].to);
      island_[std::max(a, b)] = std::min(a, b);
    }
    for (std::uint32_t node = 0; node < island_.size(); ++node) island_[node] = top_of(node);
  }

  /// The island that ties tell most of.
  std::optional<Placement> choose_next() {
    std::optional<Placement> best;
    for (std::uint32_t island = 0; island < island_.size(); ++island) {
      if (island_[island] != island || is_placed_[island]) continue;
      std::optional<Placement> found = find_best(island);
      if (found && (!best || found->num_places > best->num_places)) best = std::move(found);
    }
    return best;
  }

  /// Ties between an island and what is placed, those that are believed first.
  std::vector<std::size_t> ties_of(std::uint32_t island) const {
    std::vector<std::size_t> ties;
    for (std::size_t i = first_tie_; i < graph_.edges.size(); ++i) {
      const std::uint32_t from = island_[graph_.edges[i].from];
      const std::uint32_t to = island_[graph_.edges[i].to];
      const bool is_between =
          (from == island && is_placed_[to]) || (to == island && is_placed_[from]);
      if (is_between && is_usable(graph_.edges[i], graph_.node_from_world)) ties.push_back(i);
    }
    const auto is_believed = [&](std::size_t tie) { return is_believed_[tie] != 0; };
    std::stable_partition(ties.begin(), ties.end(), is_believed);
    return ties;
  }

  std::optional<Placement> find_best(std::uint32_t island) {
    const std::vector<std::size_t> ties = ties_of(island);
    std::vector<std::uint8_t> is_explained(graph_.edges.size(), 0);
    std::optional<Placement> best;
    for (const std::size_t tie : ties) {
      if (is_explained[tie]) continue;
      Placement placement = placed_by(island, tie, ties);
      for (const std::size_t other : placement.agreeing) is_explained[other] = 1;
      if (!best || placement.num_places > best->num_places) best = std::move(placement);
    }
    return best;
  }

  Placement placed_by(std::uint32_t island, std::size_t tie, std::span<const std::size_t> ties) {
    const std::vector<Sim3> before = graph_.node_from_world;
    Placement placement{island, tie, {}, 0};
    move(island, tie);
    is_trusted_[tie] = 1;
    const TrustedWays ways(graph_, is_trusted_);
    for (const std::size_t other : ties) {
      const PoseGraphEdge& edge = graph_.edges[other];
      const double expected = ways.expected_residual(edge);
      if (residual_of(edge, graph_.node_from_world).norm() <=
          std::max(options_.max_residual, kStillAgrees * expected)) {
        placement.agreeing.push_back(other);
      }
    }
    placement.num_places = count_places(placement.agreeing);
    is_trusted_[tie] = 0;
    graph_.node_from_world = before;
    return placement;
  }

  std::size_t count_places(std::span<const std::size_t> ties) const {
    std::vector<std::size_t> places;
    for (const std::size_t tie : ties) {
      const auto is_here = [&](std::size_t other) { return are_of_one_place(tie, other); };
      if (std::ranges::none_of(places, is_here)) places.push_back(tie);
    }
    return places.size();
  }

  bool are_of_one_place(std::size_t tie, std::size_t other) const {
    const PoseGraphEdge& a = graph_.edges[tie];
    const PoseGraphEdge& b = graph_.edges[other];
    const double radius =
        options_.same_place * a.sigma_translation / graph_.node_from_world[a.to].scale;
    const auto are_near = [&](std::uint32_t one, std::uint32_t two) {
      return (centre_of(one) - centre_of(two)).norm() < radius;
    };
    const bool is_other_way_round = island_[a.to] != island_[b.to];
    return is_other_way_round ? are_near(a.from, b.to) && are_near(a.to, b.from)
                              : are_near(a.from, b.from) && are_near(a.to, b.to);
  }

  Eigen::Vector3d centre_of(std::uint32_t node) const {
    return graph_.node_from_world[node].inverse().translation;
  }

  /// An island to where a tie has it.
  void move(std::uint32_t island, std::size_t tie) {
    std::vector<Sim3>& nodes = graph_.node_from_world;
    const PoseGraphEdge& edge = graph_.edges[tie];
    const bool is_to = island_[edge.to] == island;
    const std::uint32_t end = is_to ? edge.to : edge.from;
    const Sim3 moved =
        is_to ? edge.to_from_from * nodes[edge.from] : edge.to_from_from.inverse() * nodes[edge.to];
    const Sim3 old_world_from_new_world = nodes[end].inverse() * moved;
    for (std::uint32_t node = 0; node < nodes.size(); ++node) {
      if (island_[node] == island) nodes[node] = nodes[node] * old_world_from_new_world;
    }
  }

  void take(const Placement& placement) {
    for (const std::size_t tie : ties_of(placement.island)) {
      if (std::ranges::count(placement.agreeing, tie)) continue;
      is_believed_[tie] = 0;
      contradicts_[tie] = 1;
    }
    move(placement.island, placement.tie);
    is_believed_[placement.tie] = 1;
    is_trusted_[placement.tie] = 1;
    is_placed_[placement.island] = 1;
  }

  PoseGraph& graph_;
  const std::size_t first_tie_;
  const IslandOptions& options_;
  std::vector<std::uint32_t> island_;      // Per node: the least node of its island.
  std::vector<std::uint8_t> is_trusted_;   // Per edge.
  std::vector<std::uint8_t> is_believed_;  // Per edge; of ties.
  std::vector<std::uint8_t> contradicts_;  // Per edge; of ties.
  std::vector<std::uint8_t> is_placed_;    // Per island, by its number.
};

}  // namespace

IslandTies place_islands(PoseGraph& graph, std::size_t first_tie, const IslandOptions& options) {
  if (graph.node_from_world.empty()) return {options.believed, {}};
  return IslandPlacer(graph, first_tie, options).place();
}

}  // namespace waymark

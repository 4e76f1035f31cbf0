// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/elimination_order.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

namespace waymark {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;
using Nodes = std::vector<std::uint32_t>;

/// Parts of so many nodes are not divided.
constexpr std::size_t kMaxUndivided = 400;
/// The smaller side of a cut has so many of the nodes at least.
constexpr double kMinShareOfSide = 0.35;
/// Distances are whole numbers: their means with those of neighbours tell more.
constexpr int kNumSmoothings = 3;

/// Both neighbours of each block that is not zero.
class Graph {
 public:
  Graph(std::size_t num_nodes, const BlockPattern& pattern) : first_(num_nodes + 1, 0) {
    for (const auto& [a, b] : pattern) {
      ++first_[a + 1];
      ++first_[b + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    neighbours_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& [a, b] : pattern) {
      neighbours_[next[a]++] = b;
      neighbours_[next[b]++] = a;
    }
  }

  std::size_t size() const { return first_.size() - 1; }
  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return std::span(neighbours_).subspan(first_[node], first_[node + 1] - first_[node]);
  }

 private:
  std::vector<std::size_t> first_;
  Nodes neighbours_;
};

/// Per block its place in an order of approximate minimum degree.
Nodes minimum_degree(std::size_t num_blocks, const BlockPattern& pattern) {
  std::vector<Eigen::Triplet<double>> entries;  // With the diagonal, or rows count as dense.
  for (int i = 0; i < static_cast<int>(num_blocks); ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [row, column] : pattern) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), 1.0);
    entries.emplace_back(static_cast<int>(column), static_cast<int>(row), 1.0);
  }
  const auto size = static_cast<Eigen::Index>(num_blocks);
  Eigen::SparseMatrix<double> graph(size, size);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType block_of_position;
  Eigen::AMDOrdering<int>()(graph, block_of_position);
  Nodes position(num_blocks);
  for (std::size_t i = 0; i < num_blocks; ++i) {
    const auto block = block_of_position.indices()[static_cast<Eigen::Index>(i)];
    position[static_cast<std::size_t>(block)] = static_cast<std::uint32_t>(i);
  }
  return position;
}

/// A least set of nodes that touches all edges between two sides, by a largest matching (Koenig).
class VertexCover {
 public:
  /// is_other: per node, 1 on the other side, 0 on this one, else neither.
  VertexCover(const Graph& graph, const std::vector<std::uint8_t>& is_other)
      : graph_(graph), is_other_(is_other), match_(graph.size(), kNone), visit_(graph.size(), 0) {}

  /// Of nodes of this side, all that have edges to the other.
  void match(std::span<const std::uint32_t> nodes) {
    for (const std::uint32_t node : nodes) {
      ++num_visits_;
      find_match(node);
    }
    ++num_visits_;
    for (const std::uint32_t node : nodes) {
      if (match_[node] == kNone) reach(node);
    }
  }
  bool contains(std::uint32_t node) const {
    const bool is_reached = visit_[node] == num_visits_;
    return match_[node] != kNone && (is_other_[node] == 1 ? is_reached : !is_reached);
  }

 private:
  bool find_match(std::uint32_t node) {
    for (const std::uint32_t other : graph_.of(node)) {
      if (is_other_[other] != 1 || visit_[other] == num_visits_) continue;
      visit_[other] = num_visits_;
      if (match_[other] != kNone && !find_match(match_[other])) continue;
      match_[other] = node;
      match_[node] = other;
      return true;
    }
    return false;
  }

  /// What alternating ways from a node without a match lead to.
  void reach(std::uint32_t node) {
    Nodes open = {node};
    visit_[node] = num_visits_;
    while (!open.empty()) {
      const std::uint32_t here = open.back();
      open.pop_back();
      for (const std::uint32_t other : graph_.of(here)) {
        if (is_other_[other] != 1 || visit_[other] == num_visits_) continue;
        visit_[other] = num_visits_;
        const std::uint32_t next = match_[other];
        if (visit_[next] == num_visits_) continue;
        visit_[next] = num_visits_;
        open.push_back(next);
      }
    }
  }

  const Graph& graph_;
  const std::vector<std::uint8_t>& is_other_;
  Nodes match_;
  Nodes visit_;
  std::uint32_t num_visits_ = 0;
};

/// Nested dissection: places for all nodes, those of a separator after both of its sides.
class Dissection {
 public:
  explicit Dissection(const Graph& graph)
      : graph_(graph),
        part_(graph.size(), 0),
        visit_(graph.size(), 0),
        value_(graph.size()),
        place_(graph.size()) {}

  Nodes order() && {
    Nodes all(graph_.size());
    std::iota(all.begin(), all.end(), 0u);
    order_part(std::move(all));
    return std::move(place_);
  }

 private:
  struct Sides {
    Nodes low, high, separator;
  };

  void order_part(Nodes nodes) {
    if (nodes.empty()) return;
    ++num_parts_;
    for (const std::uint32_t node : nodes) part_[node] = num_parts_;
    if (nodes.size() <= kMaxUndivided) return order_undivided(nodes);
    Nodes order = by_distance(nodes.front());
    if (order.size() < nodes.size()) {
      std::erase_if(nodes, [&](std::uint32_t node) { return visit_[node] == num_visits_; });
      order_part(std::move(order));
      return order_part(std::move(nodes));
    }
    for (int i = 0; i < 3; ++i) order = by_distance(order.back());
    Sides sides = divide(std::move(order));
    if (sides.low.empty() || sides.high.empty()) return order_undivided(nodes);
    order_part(std::move(sides.low));
    order_part(std::move(sides.high));
    for (const std::uint32_t node : sides.separator) place_[node] = num_placed_++;
  }

  void order_undivided(const Nodes& nodes) {
    BlockPattern pattern;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) place_[nodes[i]] = i;
    for (const std::uint32_t node : nodes) {
      for (const std::uint32_t other : graph_.of(node)) {
        if (part_[other] == num_parts_ && place_[other] < place_[node]) {
          pattern.push_back({place_[node], place_[other]});
        }
      }
    }
    const Nodes position = minimum_degree(nodes.size(), pattern);
    for (std::size_t i = 0; i < nodes.size(); ++i) place_[nodes[i]] = num_placed_ + position[i];
    num_placed_ += static_cast<std::uint32_t>(nodes.size());
  }

  /// What is linked to a node within its part, nearest first, and its steps in value_.
  Nodes by_distance(std::uint32_t start) {
    ++num_visits_;
    Nodes reached = {start};
    visit_[start] = num_visits_;
    value_[start] = 0.0;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const std::uint32_t here = reached[i];
      for (const std::uint32_t next : graph_.of(here)) {
        if (part_[next] != num_parts_ || visit_[next] == num_visits_) continue;
        visit_[next] = num_visits_;
        value_[next] = value_[here] + 1.0;
        reached.push_back(next);
      }
    }
    return reached;
  }

  void smooth(const Nodes& nodes) {
    std::vector<double> means(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      double sum = value_[nodes[i]];
      double count = 1.0;
      for (const std::uint32_t next : graph_.of(nodes[i])) {
        if (part_[next] != num_parts_) continue;
        sum += value_[next];
        count += 1.0;
      }
      means[i] = sum / count;
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) value_[nodes[i]] = means[i];
  }

  /// So many of the nodes are the low side: where few of them have neighbours on the other.
  std::size_t choose_cut(const Nodes& order) {
    const std::size_t count = order.size();
    for (std::uint32_t i = 0; i < count; ++i) place_[order[i]] = i;
    // By how much the numbers of nodes at the cut change behind each node.
    std::vector<int> low(count + 1, 0);
    std::vector<int> high(count + 1, 0);
    for (std::uint32_t i = 0; i < count; ++i) {
      std::uint32_t first = i;
      std::uint32_t last = i;
      for (const std::uint32_t next : graph_.of(order[i])) {
        if (part_[next] != num_parts_) continue;
        first = std::min(first, place_[next]);
        last = std::max(last, place_[next]);
      }
      ++low[i];
      --low[last];
      ++high[first];
      --high[i];
    }
    std::size_t best = count / 2;
    double best_cost = INFINITY;
    int num_low = 0;
    int num_high = 0;
    for (std::size_t i = 0; i + 1 < count; ++i) {
      num_low += low[i];
      num_high += high[i];
      const double off = static_cast<double>(i + 1) / static_cast<double>(count) - 0.5;
      if (std::abs(off) > 0.5 - kMinShareOfSide) continue;
      const double cost = std::min(num_low, num_high) * (1.0 + 8.0 * off * off);
      if (cost < best_cost) {
        best_cost = cost;
        best = i + 1;
      }
    }
    return best;
  }

  Sides divide(Nodes order) {
    for (int i = 0; i < kNumSmoothings; ++i) smooth(order);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t node) { return value_[node]; });
    const std::size_t num_low = choose_cut(order);
    std::vector<std::uint8_t> side(graph_.size(), 2);
    for (std::size_t i = 0; i < order.size(); ++i) side[order[i]] = i >= num_low;
    VertexCover cover(graph_, side);
    cover.match(std::span(order).first(num_low));
    Sides sides;
    for (const std::uint32_t node : order) {
      Nodes& nodes = cover.contains(node) ? sides.separator
                     : side[node] == 0    ? sides.low
                                          : sides.high;
      nodes.push_back(node);
    }
    return sides;
  }

  const Graph& graph_;
  Nodes part_;
  std::uint32_t num_parts_ = 0;
  Nodes visit_;
  std::uint32_t num_visits_ = 0;
  std::vector<double> value_;
  Nodes place_;
  std::uint32_t num_placed_ = 0;
};

/// Parents in the elimination tree; kNone of roots (Liu 1990, algorithm 4.2).
Nodes elimination_tree(const BlockPattern& pattern, const Nodes& position) {
  std::vector<Nodes> columns_of_row(position.size());
  for (const auto& [a, b] : pattern) {
    columns_of_row[std::max(position[a], position[b])].push_back(
        std::min(position[a], position[b]));
  }
  Nodes parent(position.size(), kNone);
  Nodes ancestor(position.size(), kNone);
  for (std::uint32_t row = 0; row < position.size(); ++row) {
    for (std::uint32_t at : columns_of_row[row]) {
      while (at != kNone && at != row) {
        const std::uint32_t next = std::exchange(ancestor[at], row);
        if (next == kNone) parent[at] = row;
        at = next;
      }
    }
  }
  return parent;
}

/// Per node when it is reached if children come right before their parent.
Nodes postorder(const Nodes& parent) {
  Nodes subtree_size(parent.size(), 1);
  for (std::size_t i = 0; i < parent.size(); ++i) {
    if (parent[i] != kNone) subtree_size[parent[i]] += subtree_size[i];
  }
  Nodes place(parent.size());
  Nodes end_of_children(parent.size());
  auto end_of_roots = static_cast<std::uint32_t>(parent.size());
  for (std::size_t i = parent.size(); i-- > 0;) {
    std::uint32_t& end = parent[i] == kNone ? end_of_roots : end_of_children[parent[i]];
    place[i] = end_of_children[i] = end - 1;
    end -= subtree_size[i];
  }
  return place;
}

}  // namespace

std::vector<std::uint32_t> order_of_elimination(std::size_t num_blocks,
                                                const BlockPattern& pattern) {
  const Graph graph(num_blocks, pattern);
  Nodes position = Dissection(graph).order();
  const Nodes place = postorder(elimination_tree(pattern, position));
  for (std::uint32_t& at : position) at = place[at];
  return position;
}

}  // namespace waymark

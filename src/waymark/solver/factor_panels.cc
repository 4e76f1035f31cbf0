// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/factor_panels.h"

#include <algorithm>
#include <numeric>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Wider ones are divided: a panel is what one thread works on, and what stays in its caches.
constexpr std::uint32_t kMaxPanelWidth = 16;

/// Zeros that a supernode may keep, in parts of its blocks, for being as wide at most.
struct Relaxation {
  std::uint32_t max_width;
  double max_share_of_zeros;
};
constexpr Relaxation kRelaxations[] = {{4, 0.5}, {8, 0.2}, {UINT32_MAX, 0.05}};

/// Columns that share their rows below.
struct Supernode {
  std::uint32_t begin;
  std::uint32_t end;
  std::vector<std::uint32_t> below;
  std::size_t num_zeros = 0;

  std::size_t num_blocks() const {
    const std::size_t width = end - begin;
    return width * (width + 1) / 2 + width * below.size();
  }
};

/// The supernodes of the factor as it is. The rows of a column are those of the matrix, and those
/// of every earlier column whose first row below the diagonal is this one.
std::vector<Supernode> find_supernodes(std::size_t num_columns,
                                       const BlockPattern& pattern,
                                       std::size_t& num_blocks) {
  std::vector<std::vector<std::uint32_t>> rows(num_columns);
  for (const auto& [row, column] : pattern) {
    WAYMARK_CHECK(row > column && row < num_columns);
    rows[column].push_back(row);
  }
  std::vector<Supernode> nodes;
  for (std::uint32_t column = 0; column < num_columns; ++column) {
    std::vector<std::uint32_t> below = std::move(rows[column]);
    std::sort(below.begin(), below.end());
    below.erase(std::unique(below.begin(), below.end()), below.end());
    below.shrink_to_fit();
    num_blocks += 1 + below.size();
    if (!below.empty()) {
      auto& parent = rows[below.front()];
      parent.insert(parent.end(), below.begin() + 1, below.end());
    }
    const bool goes_on = !nodes.empty() && !nodes.back().below.empty() &&
                         nodes.back().below.front() == column &&
                         nodes.back().below.size() == below.size() + 1;
    if (!goes_on) nodes.push_back({column, column, {}});
    nodes.back().end = column + 1;
    nodes.back().below = std::move(below);
  }
  return nodes;
}

bool is_worth_joining(const Supernode& joined) {
  const std::uint32_t width = joined.end - joined.begin;
  const auto relaxation = std::ranges::find_if(
      kRelaxations, [width](const Relaxation& entry) { return width <= entry.max_width; });
  return static_cast<double>(joined.num_zeros) <=
         relaxation->max_share_of_zeros * static_cast<double>(joined.num_blocks());
}

/// Joins supernodes with the parent that follows them where that keeps few zeros (Ashcraft & Grimes
/// 1989).
std::vector<Supernode> join_supernodes(std::vector<Supernode> nodes) {
  std::vector<Supernode> joined;
  for (Supernode& node : nodes) {
    while (!joined.empty()) {
      const Supernode& child = joined.back();
      if (child.below.empty() || child.below.front() >= node.end) break;
      Supernode both{child.begin, node.end, node.below};
      both.num_zeros = child.num_zeros + node.num_zeros + both.num_blocks() - child.num_blocks() -
                       node.num_blocks();
      if (!is_worth_joining(both)) break;
      node = std::move(both);
      joined.pop_back();
    }
    joined.push_back(std::move(node));
  }
  return joined;
}

void divide(const Supernode& node, FactorPanels& plan) {
  const std::uint32_t width = node.end - node.begin;
  const std::uint32_t num_parts = (width + kMaxPanelWidth - 1) / kMaxPanelWidth;
  const std::size_t first_row = plan.rows.size();
  for (std::uint32_t row = node.begin; row < node.end; ++row) plan.rows.push_back(row);
  plan.rows.insert(plan.rows.end(), node.below.begin(), node.below.end());
  for (std::uint32_t part = 0; part < num_parts; ++part) {
    const std::uint32_t begin = width * part / num_parts;
    const std::uint32_t end = width * (part + 1) / num_parts;
    for (std::uint32_t i = begin; i < end; ++i) {
      plan.panel_of_column.push_back(static_cast<std::uint32_t>(plan.panels.size()));
    }
    plan.panels.push_back({node.begin + begin,
                           node.begin + end,
                           first_row + begin,
                           plan.rows.size() - first_row - begin});
  }
}

/// Calls visit(target, source) for each pair of panels of which one acts on the other.
template <class Visit>
void visit_sources(const FactorPanels& plan, const Visit& visit) {
  for (std::uint32_t index = 0; index < plan.panels.size(); ++index) {
    const FactorPanels::Panel& panel = plan.panels[index];
    const auto rows = plan.rows_of(panel);
    for (std::uint32_t first = panel.width(); first < rows.size();) {
      const std::uint32_t target = plan.panel_of_column[rows[first]];
      std::uint32_t last = first + 1;
      while (last < rows.size() && rows[last] < plan.panels[target].end) ++last;
      visit(target, FactorPanels::Source{index, first, last});
      first = last;
    }
  }
}

void list_sources(FactorPanels& plan) {
  plan.first_source.assign(plan.panels.size() + 1, 0);
  visit_sources(plan, [&](std::uint32_t target, const auto&) { ++plan.first_source[target + 1]; });
  std::partial_sum(plan.first_source.begin(), plan.first_source.end(), plan.first_source.begin());
  plan.sources.resize(plan.first_source.back());
  std::vector<std::size_t> next(plan.first_source.begin(), plan.first_source.end() - 1);
  visit_sources(plan, [&](std::uint32_t target, const FactorPanels::Source& source) {
    plan.sources[next[target]++] = source;
  });
}

void make_schedule(FactorPanels& plan) {
  std::vector<std::uint32_t> level(plan.panels.size(), 0);
  for (std::size_t panel = 0; panel < plan.panels.size(); ++panel) {
    for (const FactorPanels::Source& source : plan.sources_of(panel)) {
      level[panel] = std::max(level[panel], level[source.panel] + 1);
    }
  }
  plan.schedule.resize(plan.panels.size());
  std::iota(plan.schedule.begin(), plan.schedule.end(), 0u);
  std::ranges::stable_sort(plan.schedule, {}, [&](std::uint32_t panel) { return level[panel]; });
}

}  // namespace

FactorPanels plan_panels(std::size_t num_columns, const BlockPattern& pattern) {
  FactorPanels plan;
  for (const Supernode& node :
       join_supernodes(find_supernodes(num_columns, pattern, plan.num_blocks))) {
    divide(node, plan);
  }
  list_sources(plan);
  make_schedule(plan);
  return plan;
}

}  // namespace waymark

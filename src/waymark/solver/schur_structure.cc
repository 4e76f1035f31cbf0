// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>
#include <utility>

#include "waymark/solver/schur_solver.h"

namespace waymark {

namespace {

/// Numbers in rows of different lengths.
struct Rows {
  std::vector<std::uint32_t> first = {0};  ///< Per row, and one past the end.
  std::vector<std::uint32_t> entries;

  std::size_t size() const { return first.size() - 1; }
  std::span<const std::uint32_t> operator[](std::size_t row) const {
    return std::span(entries).subspan(first[row], first[row + 1] - first[row]);
  }
  void end_row() { first.push_back(static_cast<std::uint32_t>(entries.size())); }
};

/// The slots of each point that more than one sees.
Rows list_slots(const BundleProblem& problem,
                std::span<const std::uint8_t> is_used,
                const SchurStructure& plan) {
  Rows slots_of_point;
  auto& entries = slots_of_point.entries;
  for (std::size_t i = 0; i < problem.observations.size();) {
    const std::uint32_t point = problem.observations[i].point;
    const auto begin = static_cast<std::ptrdiff_t>(entries.size());
    for (; i < problem.observations.size() && problem.observations[i].point == point; ++i) {
      const std::uint32_t slot = plan.slot_of_pose[problem.observations[i].pose];
      if (is_used[i] && slot != kNoSlot) entries.push_back(slot);
    }
    std::sort(entries.begin() + begin, entries.end());
    entries.erase(std::unique(entries.begin() + begin, entries.end()), entries.end());
    if (std::ssize(entries) - begin > 1) {
      slots_of_point.end_row();
    } else {
      entries.resize(static_cast<std::size_t>(begin));
    }
  }
  return slots_of_point;
}

/// Per number the rows that have it, ascending.
Rows invert(const Rows& rows, std::size_t num_numbers) {
  Rows inverse;
  inverse.first.assign(num_numbers + 1, 0);
  for (const std::uint32_t number : rows.entries) ++inverse.first[number + 1];
  for (std::size_t i = 0; i < num_numbers; ++i) inverse.first[i + 1] += inverse.first[i];
  std::vector<std::uint32_t> next(inverse.first.begin(), inverse.first.end() - 1);
  inverse.entries.resize(rows.entries.size());
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (const std::uint32_t number : rows[row]) {
      inverse.entries[next[number]++] = static_cast<std::uint32_t>(row);
    }
  }
  return inverse;
}

/// Slots that see a point in common, by row and column. Time is that of all pairs of a point, and
/// memory that of the observations: nothing is as large as the square of the slots.
BlockPattern find_pattern(const BundleProblem& problem,
                          std::span<const std::uint8_t> is_used,
                          const SchurStructure& plan) {
  const Rows slots_of_point = list_slots(problem, is_used, plan);
  const Rows points_of_slot = invert(slots_of_point, plan.num_slots);
  std::vector<std::uint32_t> last_row(plan.num_slots, kNoSlot);  // Per column, that has it.
  BlockPattern pattern;
  for (std::uint32_t row = 0; row < plan.num_slots; ++row) {
    const auto begin = static_cast<std::ptrdiff_t>(pattern.size());
    for (const std::uint32_t point : points_of_slot[row]) {
      for (const std::uint32_t column : slots_of_point[point]) {
        if (column >= row) break;
        if (std::exchange(last_row[column], row) != row) pattern.push_back({row, column});
      }
    }
    std::sort(pattern.begin() + begin, pattern.end());
  }
  return pattern;
}

/// Adds slots that have a term in common.
void add_terms(const BundleMotion& motion, SchurStructure& plan) {
  for (const BundleMotion::Term& term : motion.terms) {
    const SlotsOfTerm slots = slots_of(term, plan);
    for (const std::uint32_t row : slots) {
      for (const std::uint32_t column : slots) {
        if (row != kNoSlot && column < row) plan.pattern.push_back({row, column});
      }
    }
  }
  std::ranges::sort(plan.pattern);
  plan.pattern.erase(std::unique(plan.pattern.begin(), plan.pattern.end()), plan.pattern.end());
}

/// Numbers the slots in an order of little fill-in.
void order_slots(SchurStructure& plan) {
  const std::vector<std::uint32_t> position = order_of_elimination(plan.num_slots, plan.pattern);
  for (std::uint32_t& slot : plan.slot_of_pose) {
    if (slot != kNoSlot) slot = position[slot];
  }
  for (std::uint32_t& slot : plan.slot_of_unknown) slot = position[slot];
  for (auto& [row, column] : plan.pattern) {
    std::tie(row, column) = std::pair(std::max(position[row], position[column]),
                                      std::min(position[row], position[column]));
  }
}

/// Appends the links of the point whose observations start at begin.
void link_point(const BundleProblem& problem, std::size_t begin, SchurStructure& plan) {
  const auto first = static_cast<std::ptrdiff_t>(plan.slot_of_link.size());
  for (std::size_t k = begin; k < plan.observations.size(); ++k) {
    const auto slot = plan.slot_of_pose[problem.observations[plan.observations[k]].pose];
    if (slot != kNoSlot) plan.slot_of_link.push_back(slot);
  }
  auto& slots = plan.slot_of_link;
  std::sort(slots.begin() + first, slots.end());
  slots.erase(std::unique(slots.begin() + first, slots.end()), slots.end());
  for (std::size_t k = begin; k < plan.observations.size(); ++k) {
    const auto slot = plan.slot_of_pose[problem.observations[plan.observations[k]].pose];
    const auto link = std::lower_bound(slots.begin() + first, slots.end(), slot) - slots.begin();
    plan.link_of_observation.push_back(slot == kNoSlot ? kNoSlot
                                                       : static_cast<std::uint32_t>(link));
  }
  plan.first_observation.push_back(static_cast<std::uint32_t>(plan.observations.size()));
  plan.first_link.push_back(static_cast<std::uint32_t>(slots.size()));
}

}  // namespace

SchurStructure make_schur_structure(const BundleProblem& problem,
                                    std::span<const std::uint8_t> is_used) {
  SchurStructure plan;
  for (const std::uint8_t is_fixed : problem.is_pose_fixed) {
    plan.slot_of_pose.push_back(is_fixed ? kNoSlot : static_cast<std::uint32_t>(plan.num_slots));
    plan.num_slots += is_fixed ? 0 : 1;
  }
  const std::size_t num_unknowns = problem.motion ? problem.motion->unknowns.size() : 0;
  for (std::size_t i = 0; i < num_unknowns; ++i) {
    plan.slot_of_unknown.push_back(static_cast<std::uint32_t>(plan.num_slots++));
  }
  plan.pattern = find_pattern(problem, is_used, plan);
  if (problem.motion) add_terms(*problem.motion, plan);
  order_slots(plan);
  plan.observations.reserve(problem.observations.size());
  plan.link_of_observation.reserve(problem.observations.size());
  plan.slot_of_link.reserve(problem.observations.size());
  plan.first_observation.push_back(0);
  plan.first_link.push_back(0);
  for (std::size_t i = 0; i < problem.observations.size();) {
    const std::uint32_t point = problem.observations[i].point;
    const std::size_t begin = plan.observations.size();
    for (; i < problem.observations.size() && problem.observations[i].point == point; ++i) {
      if (is_used[i]) plan.observations.push_back(static_cast<std::uint32_t>(i));
    }
    if (plan.observations.size() == begin) continue;
    plan.points.push_back(point);
    link_point(problem, begin, plan);
  }
  return plan;
}

}  // namespace waymark

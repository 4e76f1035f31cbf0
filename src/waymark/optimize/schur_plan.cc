// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>
#include <utility>

#include "waymark/optimize/schur_solver.h"

namespace waymark {

namespace {

/// Slots that see a point in common.
BlockPattern find_pattern(const BundleProblem& problem,
                          std::span<const std::uint8_t> is_used,
                          const SchurPlan& plan) {
  const std::size_t size = plan.num_slots;
  std::vector<bool> is_linked(size * size);
  std::vector<std::uint32_t> slots;
  for (std::size_t i = 0; i < problem.observations.size();) {
    const std::uint32_t point = problem.observations[i].point;
    slots.clear();
    for (; i < problem.observations.size() && problem.observations[i].point == point; ++i) {
      const std::uint32_t slot = plan.slot_of_pose[problem.observations[i].pose];
      if (is_used[i] && slot != kNoSlot) slots.push_back(slot);
    }
    for (const std::uint32_t row : slots) {
      for (const std::uint32_t column : slots) is_linked[row * size + column] = true;
    }
  }
  BlockPattern pattern;
  for (std::uint32_t row = 0; row < size; ++row) {
    for (std::uint32_t column = 0; column < row; ++column) {
      if (is_linked[row * size + column]) pattern.push_back({row, column});
    }
  }
  return pattern;
}

/// Numbers the slots in an order of little fill-in.
void order_slots(SchurPlan& plan) {
  const std::vector<std::uint32_t> position = order_of_elimination(plan.num_slots, plan.pattern);
  for (std::uint32_t& slot : plan.slot_of_pose) {
    if (slot != kNoSlot) slot = position[slot];
  }
  for (auto& [row, column] : plan.pattern) {
    std::tie(row, column) = std::pair(std::max(position[row], position[column]),
                                      std::min(position[row], position[column]));
  }
}

/// Appends the links of the point whose observations start at begin.
void link_point(const BundleProblem& problem, std::size_t begin, SchurPlan& plan) {
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

SchurPlan make_schur_plan(const BundleProblem& problem, std::span<const std::uint8_t> is_used) {
  SchurPlan plan;
  for (const std::uint8_t is_fixed : problem.is_pose_fixed) {
    plan.slot_of_pose.push_back(is_fixed ? kNoSlot : static_cast<std::uint32_t>(plan.num_slots));
    plan.num_slots += is_fixed ? 0 : 1;
  }
  plan.pattern = find_pattern(problem, is_used, plan);
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

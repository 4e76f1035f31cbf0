// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "waymark/solver/schur_solver.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

using SlotPairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// All pairs of free poses that see a point in common, one by one.
SlotPairs linked_slots(const BundleProblem& problem,
                       const std::vector<std::uint8_t>& is_used,
                       const SchurStructure& plan) {
  SlotPairs pairs;
  for (std::size_t a = 0; a < problem.observations.size(); ++a) {
    for (std::size_t b = 0; b < problem.observations.size(); ++b) {
      if (!is_used[a] || !is_used[b]) continue;
      if (problem.observations[a].point != problem.observations[b].point) continue;
      const std::uint32_t row = plan.slot_of_pose[problem.observations[a].pose];
      const std::uint32_t column = plan.slot_of_pose[problem.observations[b].pose];
      if (row != kNoSlot && column != kNoSlot && row > column) pairs.insert({row, column});
    }
  }
  return pairs;
}

TEST(SchurStructure, LinksThePosesThatSeeAPointInCommon) {
  for (const std::size_t num_cameras : {1u, 2u}) {
    const auto scene = testing::make_bundle_scene(
        {.num_poses = 30, .num_fixed = 5, .num_points = 200, .num_cameras = num_cameras}, 1);
    BundleProblem problem = scene.problem;
    std::vector<std::uint8_t> is_used(problem.observations.size(), 1);
    for (std::size_t i = 0; i < is_used.size(); i += 5) is_used[i] = 0;
    const SchurStructure plan = make_schur_structure(problem, is_used);
    const SlotPairs expected = linked_slots(problem, is_used, plan);
    EXPECT_EQ(plan.pattern.size(), expected.size());
    EXPECT_EQ(SlotPairs(plan.pattern.begin(), plan.pattern.end()), expected);
    EXPECT_GT(expected.size(), 25u);
  }
}

}  // namespace
}  // namespace waymark

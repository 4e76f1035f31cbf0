// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/base/testing/allocation_count.h"
#include "waymark/optimize/pose.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

TEST(PoseAllocation, NoneAfterWarmUp) {
  const auto scene = testing::make_pose_scene(
      {.num_cameras = 2, .share_of_outliers = 0.4, .range_sigma = 0.01}, 13);
  Rng rng(13, 9);
  const Rigid3 initial =
      Rigid3::exp(testing::random_tangent(rng, 0.05, 0.01)) * scene.rig_from_world;
  PoseWorkspace workspace;
  optimize_pose(scene.rig, scene.observations, initial, workspace);
  const long before = testing::num_allocations();
  optimize_pose(scene.rig, scene.observations, initial, workspace);
  EXPECT_EQ(testing::num_allocations(), before);
}

}  // namespace
}  // namespace waymark

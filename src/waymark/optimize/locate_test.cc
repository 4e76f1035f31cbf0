// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/locate.h"

#include <gtest/gtest.h>

#include <limits>

#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

using testing::make_pose_scene;
using testing::PoseScene;
using testing::random_vector;

/// Bearings of the scene replaced by those of points elsewhere, as by wrong matches.
void mismatch(PoseScene& scene, double share, Rng& rng) {
  auto& observations = scene.observations;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (rng.uniform() >= share) continue;
    const auto other = rng.below(static_cast<std::uint32_t>(observations.size()));
    observations.point_in_world[i] = observations.point_in_world[other] + random_vector(rng, 1.0);
    scene.is_inlier[i] = false;
  }
}

std::optional<PoseEstimate> run(const PoseScene& scene, PoseWorkspace& workspace) {
  return locate(scene.rig, scene.observations, {.seed = 3, .min_inlier_ratio = 0.15}, workspace);
}

TEST(Locate, FindsThePoseWithoutAPredictionAmongWrongMatches) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    PoseScene scene = make_pose_scene({.num_observations = 200, .num_cameras = 1 + seed % 3}, seed);
    Rng rng(seed, 5);
    mismatch(scene, 0.6, rng);
    PoseWorkspace workspace;
    const auto estimate = run(scene, workspace);
    ASSERT_TRUE(estimate.has_value()) << seed;
    const Vector6d error = (estimate->rig_from_world * scene.rig_from_world.inverse()).log();
    EXPECT_LT(error.head<3>().norm(), 0.08) << seed;
    EXPECT_LT(error.tail<3>().norm(), 0.008) << seed;
    std::size_t num_wrong = 0;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      num_wrong += scene.is_inlier[i] != estimate->is_inlier[i];
    }
    EXPECT_LT(num_wrong, scene.is_inlier.size() / 12) << seed;
  }
}

TEST(Locate, GivesTheSameBitsTwice) {
  PoseScene scene = make_pose_scene({.num_cameras = 2, .share_of_outliers = 0.4}, 1);
  PoseWorkspace first_workspace, second_workspace;
  const auto first = run(scene, first_workspace), second = run(scene, second_workspace);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->rig_from_world.translation, second->rig_from_world.translation);
  EXPECT_EQ(first->rig_from_world.rotation.coeffs(), second->rig_from_world.rotation.coeffs());
}

TEST(Locate, NothingWithoutObservationsOrSupport) {
  PoseWorkspace workspace;
  PoseScene scene = make_pose_scene({.num_observations = 0}, 1);
  EXPECT_FALSE(run(scene, workspace));
  scene = make_pose_scene({.num_observations = 3}, 1);
  EXPECT_FALSE(run(scene, workspace));  // No datum beyond the sample speaks for it.
  scene = make_pose_scene({.num_observations = 50}, 1);
  for (Eigen::Vector3d& point : scene.observations.point_in_world) point.setConstant(1.0);
  EXPECT_FALSE(run(scene, workspace));
}

TEST(Locate, LeavesOutWhatIsNotFiniteAndUnknownCameras) {
  PoseScene scene = make_pose_scene({.num_observations = 120}, 2);
  auto& observations = scene.observations;
  for (std::size_t i = 0; i < 40; i += 4) {
    observations.point_in_world[i].x() = std::numeric_limits<double>::quiet_NaN();
    observations.bearing[i + 1].y() = std::numeric_limits<float>::infinity();
    observations.level_pixel_from_bearing[i + 2].setZero();
    observations.camera[i + 3] = 9;
  }
  PoseWorkspace workspace;
  const auto estimate = run(scene, workspace);
  ASSERT_TRUE(estimate.has_value());
  EXPECT_LT((estimate->rig_from_world * scene.rig_from_world.inverse()).log().norm(), 0.05);
  EXPECT_GT(estimate->num_inliers, 70u);
}

}  // namespace
}  // namespace waymark

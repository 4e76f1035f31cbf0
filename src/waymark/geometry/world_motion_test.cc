// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/world_motion.h"

#include <gtest/gtest.h>

#include "waymark/geometry/test_scenes.h"

namespace waymark {
namespace {

constexpr double kPixelRad = 1.0 / 500.0;
/// Features are known better than the pixel that is assumed of them.
constexpr double kNoiseRad = 0.25 * kPixelRad;
const testing::View kView{false, 0.6, 0.45};

void add_match(const Eigen::Vector3d& in_a,
               const Eigen::Vector3d& in_b,
               Rng& rng,
               testing::TwoViewScene& scene) {
  if (!kView.contains(in_a) || !kView.contains(in_b)) return;
  scene.bearings_a.push_back(testing::disturb(in_a.normalized(), kNoiseRad, rng));
  scene.bearings_b.push_back(testing::disturb(in_b.normalized(), kNoiseRad, rng));
  scene.sigmas_rad_a.push_back(kPixelRad);
  scene.sigmas_rad_b.push_back(kPixelRad);
}

/// A room, and in it two people with many corners who walk along and to the side, by how wide
/// each is.
testing::TwoViewScene room_with_walkers(const Rigid3& b_from_a,
                                        const Eigen::Vector3d& walked,
                                        double width,
                                        Rng& rng) {
  testing::TwoViewScene scene;
  scene.b_from_a = b_from_a;
  for (int i = 0; i < 340; ++i) {
    const double depth = rng.uniform(2.5, 5.0);
    const Eigen::Vector3d point(
        depth * rng.uniform(-0.7, 0.7), depth * rng.uniform(-0.5, 0.5), depth);
    if (std::abs(point.x() / depth) > 0.06 && std::abs(point.x() / depth) < 0.26) continue;
    add_match(point, b_from_a * point, rng, scene);
  }
  for (int i = 0; i < 240; ++i) {
    const double side = i % 2 == 0 ? -0.2 : 0.22;
    const double x = side + rng.uniform(-0.5, 0.5) * width;
    const Eigen::Vector3d point(x, rng.uniform(-0.5, 0.5), 1.3 - 0.1 * std::cos(12 * (x - side)));
    const Eigen::Vector3d now = point + walked;
    add_match(point, b_from_a * now, rng, scene);
  }
  return scene;
}

const Rigid3 kStep(so3_exp({0.002, 0.015, 0.0}), {0.05, 0.0, -0.4});
const TwoViewOptions kOptions{.seed = 3, .min_num_points = 60, .min_parallax_rad = 12 * kPixelRad};

/// Looks at it, and counts how often estimate_two_view() takes the motion of the crowd, or none.
class CrowdedRoom : public ::testing::Test {
 protected:
  testing::TwoViewScene look(std::uint64_t trial, double width) {
    Rng rng(4, trial);
    const auto scene = room_with_walkers(kStep, {0.15, 0.0, 0.36}, width, rng);
    const TwoViewResult most = estimate_two_view(scene.matches(), kOptions);
    num_misled_ += !most.geometry || !is_step(*most.geometry);
    return scene;
  }

  static bool is_step(const TwoViewGeometry& geometry) {
    return testing::direction_error_rad(geometry.b_from_a, kStep) < 0.06 &&
           testing::rotation_error_rad(geometry.b_from_a, kStep) < 0.004;
  }

  int num_misled_ = 0;
};

TEST_F(CrowdedRoom, IsSeenBehindWalkersWhoHaveMostMatches) {
  for (std::uint64_t trial = 0; trial < 5; ++trial) {
    const auto scene = look(trial, 0.12);
    const TwoViewResult world = estimate_world_motion(scene.matches(), kOptions);
    ASSERT_EQ(world.status, TwoViewStatus::kOk) << trial;
    EXPECT_TRUE(is_step(*world.geometry)) << trial;
  }
  EXPECT_GE(num_misled_, 4) << "the scene is hard";
}

TEST_F(CrowdedRoom, IsWaitedForWhereWalkersFillAsMuchOfTheView) {
  for (std::uint64_t trial = 0; trial < 5; ++trial) {
    const auto scene = look(trial, 0.24);
    const TwoViewResult world = estimate_world_motion(scene.matches(), kOptions);
    EXPECT_TRUE(!world.geometry || is_step(*world.geometry)) << trial;
  }
  EXPECT_GE(num_misled_, 4) << "the scene is hard";
}

TEST(WorldMotion, IsTheCommonOneWhereNothingMoves) {
  Rng rng(5, 0);
  const auto scene = room_with_walkers(kStep, Eigen::Vector3d::Zero(), 0.24, rng);
  const TwoViewResult world = estimate_world_motion(scene.matches(), kOptions);
  const TwoViewResult common = estimate_two_view(scene.matches(), kOptions);
  ASSERT_TRUE(world.geometry && common.geometry);
  EXPECT_EQ(world.geometry->b_from_a.matrix(), common.geometry->b_from_a.matrix());
  EXPECT_EQ(world.geometry->is_inlier, common.geometry->is_inlier);
}

TEST(WorldMotion, PassesOnWhyThereIsNone) {
  Rng rng(6, 0);
  const auto still = room_with_walkers(Rigid3{}, Eigen::Vector3d::Zero(), 0.24, rng);
  EXPECT_EQ(estimate_world_motion(still.matches(), kOptions).status,
            TwoViewStatus::kTooLittleParallax);
  EXPECT_EQ(estimate_world_motion({}, kOptions).status, TwoViewStatus::kTooFewMatches);
}

}  // namespace
}  // namespace waymark

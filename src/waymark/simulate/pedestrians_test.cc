// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/pedestrians.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "waymark/camera/perspective.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

constexpr double kCrossingS = 20.0;
constexpr double kDepthUnitsPerMetre = 1000.0;

class Walkers : public ::testing::Test {
 protected:
  DepthImage depth_at(const World& world, double time_s) {
    const auto shared = std::make_shared<const World>(world);
    return Renderer(shared, camera_)
        .depth(motion_.world_from_rig(time_s), kDepthUnitsPerMetre, pool_, time_s);
  }

  std::shared_ptr<const Camera> camera_ =
      std::make_shared<PerspectiveCamera>(PerspectiveModel({52.0, 52.0}, {39.5, 29.5}), 80, 60);
  Motion motion_ = make_motion("hall", "loop", kCrossingS);
  std::shared_ptr<const World> empty_ = make_world("hall", 1);
  ThreadPool pool_{1};
};

TEST_F(Walkers, HideUpToHalfOfTheView) {
  World world = *empty_;
  add_pedestrians(3, motion_, 5, world);
  std::vector<double> hidden;
  for (double t = 0.25; t < kCrossingS; t += 0.5) {
    const DepthImage without = depth_at(*empty_, t);
    const DepthImage with = depth_at(world, t);
    const auto num_nearer = std::inner_product(with.values.begin(),
                                               with.values.end(),
                                               without.values.begin(),
                                               0.0,
                                               std::plus<>(),
                                               [](int a, int b) { return a < b ? 1.0 : 0.0; });
    hidden.push_back(num_nearer / static_cast<double>(with.values.size()));
  }
  EXPECT_GT(*std::ranges::max_element(hidden), 0.4);
  EXPECT_LT(*std::ranges::max_element(hidden), 0.6);
  EXPECT_GT(std::accumulate(hidden.begin(), hidden.end(), 0.0) / static_cast<double>(hidden.size()),
            0.15);
}

TEST_F(Walkers, AreThereFromTheirFirstSecondToTheirLast) {
  World world = *empty_;
  add_pedestrians(1, motion_, 5, world);
  for (const Pedestrian& walk : world.walks) {
    for (const double time_s : {walk.start_s - 0.01, walk.start_s + 1.0, walk.end_s + 0.01}) {
      const bool is_there = time_s >= walk.start_s && time_s < walk.end_s;
      const std::vector<Surface> surfaces = world.surfaces_at(time_s);
      for (std::uint32_t i = walk.first_surface; i < walk.end_surface; ++i) {
        EXPECT_EQ(surfaces[i].origin.z() > 0.0, is_there);
        if (!is_there) continue;
        const Eigen::Vector3d off =
            surfaces[i].origin - world.surfaces[i].origin - walk.start - walk.velocity;
        EXPECT_LT(off.norm(), 1e-9);
      }
    }
  }
  EXPECT_GE(world.walks.size(), 5u);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/perspective.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

constexpr double kDurationS = 60.0;
constexpr double kUnitsPerMetre = 1000.0;

struct Place {
  const char* world;
  int num_changes;
};

class ChangesIn : public ::testing::TestWithParam<Place> {
 protected:
  ChangesIn() { add_changes(GetParam().num_changes, motion_, 5, *world_); }

  /// Number of pixels in which an image would differ with the things as they are at another time.
  std::ptrdiff_t num_different(double seen_s, double things_s) {
    const Rigid3 pose = motion_.world_from_rig(seen_s);
    const DepthImage now = renderer_.depth(pose, kUnitsPerMetre, pool_, seen_s);
    const DepthImage then = renderer_.depth(pose, kUnitsPerMetre, pool_, things_s);
    std::ptrdiff_t count = 0;
    for (std::size_t i = 0; i < now.values.size(); ++i) count += now.values[i] != then.values[i];
    return count;
  }

  std::shared_ptr<World> world_ = std::make_shared<World>(*make_world(GetParam().world, 1));
  Motion motion_ = make_motion(GetParam().world, "rounds", kDurationS);
  std::shared_ptr<const Camera> camera_ =
      std::make_shared<PerspectiveCamera>(PerspectiveModel({52.0, 52.0}, {39.5, 29.5}), 80, 60);
  Renderer renderer_{world_, camera_};
  ThreadPool pool_{1};
};

TEST_P(ChangesIn, AreSeenFromTheWayBothBeforeAndAfter) {
  constexpr int kNumPixels = 80 * 60;
  for (const double first_s : {0.0, 0.6 * kDurationS}) {
    std::ptrdiff_t most = 0;
    for (double t = first_s; t < first_s + 0.4 * kDurationS; t += 0.5) {
      most = std::max(most, num_different(t, kDurationS - first_s));
    }
    EXPECT_GT(most, kNumPixels / 20) << "from " << first_s << " s on";
  }
}

TEST_P(ChangesIn, HappenBehindTheCamera) {
  int num_changes = 0;
  for (const Pedestrian& walk : world_->walks) {
    const double change_s = walk.start_s > 0.0 ? walk.start_s : walk.end_s;
    EXPECT_GE(change_s, 0.5 * kDurationS);
    EXPECT_LT(change_s, kDurationS);
    EXPECT_EQ(num_different(change_s, change_s - 1e-3), 0);
    num_changes += walk.start_s <= 0.0;
  }
  EXPECT_EQ(num_changes, GetParam().num_changes);
}

TEST_P(ChangesIn, KeepClearOfTheWay) {
  const double radius = 60.0 * world_->textures.front().texel_m();
  for (double t = 0.0; t < kDurationS; t += 0.2) {
    const std::vector<Surface> surfaces = world_->surfaces_at(t);
    const Eigen::Vector3d eye = motion_.world_from_rig(t).translation;
    for (const Pedestrian& walk : world_->walks) {
      if (t < walk.start_s || t >= walk.end_s) continue;
      for (std::uint32_t i = walk.first_surface; i < walk.end_surface; ++i) {
        for (const double u : {0.0, 0.5, 1.0}) {
          const Eigen::Vector3d point =
              surface_point(surfaces[i], {u * surfaces[i].size.x(), surfaces[i].size.y()});
          EXPECT_GT((point - eye).head<2>().norm(), radius) << t;
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds,
                         ChangesIn,
                         ::testing::Values(Place{"apartment", 4},
                                           Place{"hall", 6},
                                           Place{"street", 4}),
                         [](const auto& info) { return info.param.world; });

TEST(Changes, ThatHaveNoRoomAreAnError) {
  World world = *make_world("room", 1);
  const Motion motion = make_motion("room", "rounds", kDurationS);
  EXPECT_THROW(add_changes(50, motion, 5, world), InputError);
}

}  // namespace
}  // namespace waymark

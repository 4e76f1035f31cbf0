// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "waymark/camera/perspective.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/render.h"
#include "waymark/system/system.h"

namespace waymark {
namespace {

constexpr int kNumLoopViews = 62;
constexpr double kTurnDeg = 8.0;  // Per frame: the first view is seen again in frame 45.
constexpr double kUnitsPerMetre = 1000.0;

struct View {
  std::int64_t timestamp_ns;
  Image image;
  DepthImage depth;
};

/// A small camera with depth turns round in a room, and a third of a round more.
struct Turn {
  Rig rig;
  std::vector<View> views;

  Turn() {
    constexpr int kWidth = 240;
    constexpr int kHeight = 160;
    rig.cameras.push_back({std::make_shared<PerspectiveCamera>(
                               PerspectiveModel({150.0, 150.0}, {119.5, 79.5}), kWidth, kHeight),
                           Rigid3()});
    const Renderer renderer(make_world("room", 0), rig.cameras[0].camera);
    ThreadPool pool(2);
    for (int i = 0; i < kNumLoopViews; ++i) {
      const double yaw_deg = kTurnDeg * i;
      const double yaw = yaw_deg * std::numbers::pi / 180.0;
      const Eigen::Vector3d middle(3.0, 1.6, 1.5);
      const Eigen::Vector3d arm(0.3 * std::cos(yaw), 0.3 * std::sin(yaw), 0.0);
      const Rigid3 world_from_rig = pose_of({middle + arm, yaw_deg, 0.0, 0.0});
      views.push_back({std::int64_t{i} * 50'000'000,
                       renderer.image(world_from_rig, pool),
                       renderer.depth(world_from_rig, kUnitsPerMetre, pool)});
    }
  }
};

struct PlayedLoop {
  std::vector<TrackingResult> results;
  std::vector<TrajectoryFrame> trajectory;
  SystemStatistics statistics;
  std::shared_ptr<const Map> map;
};

PlayedLoop play(const Turn& turn, Timing timing) {
  Settings settings;
  settings.features.count = 500;
  settings.depth.factor = kUnitsPerMetre;
  settings.global_latency = 5;  // The adjustment is taken in before the end.
  System system(turn.rig, settings, timing);
  PlayedLoop played;
  for (const View& view : turn.views) {
    FrameImages input;
    input.timestamp_ns = view.timestamp_ns;
    input.image0 = view.image.view();
    input.depth = view.depth.view();
    played.results.push_back(system.feed(input));
  }
  system.finish();
  played.trajectory = system.trajectory();
  played.statistics = system.statistics();
  played.map = system.map();
  return played;
}

TEST(System, InlineAndLockstepCloseALoopAlike) {
  const Turn turn;
  const PlayedLoop alone = play(turn, Timing::kInline);
  ASSERT_GE(alone.statistics.num_loops, 1);
  ASSERT_EQ(alone.map->broken_invariants(), "");
  // Found and adjusted on the way, not at the end.
  const KeyframeId seen_again = alone.map->loop_edges().front().to;
  EXPECT_LT(alone.map->keyframes().at(seen_again).frame.value, kNumLoopViews - 10u);
  const PlayedLoop threaded = play(turn, Timing::kLockstep);
  EXPECT_EQ(threaded.statistics.num_loops, alone.statistics.num_loops);
  ASSERT_EQ(threaded.trajectory.size(), static_cast<std::size_t>(kNumLoopViews));
  ASSERT_EQ(alone.trajectory.size(), threaded.trajectory.size());
  for (std::size_t i = 0; i < alone.trajectory.size(); ++i) {
    EXPECT_EQ(alone.results[i].world_from_rig->matrix(),
              threaded.results[i].world_from_rig->matrix())
        << "frame " << i;
    EXPECT_EQ(alone.trajectory[i].world_from_rig.matrix(),
              threaded.trajectory[i].world_from_rig.matrix())
        << "frame " << i;
  }
  ASSERT_EQ(alone.map->landmarks().size(), threaded.map->landmarks().size());
  alone.map->landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_EQ(landmark.position_in_world, threaded.map->landmarks().at(id).position_in_world);
  });
}

}  // namespace
}  // namespace waymark

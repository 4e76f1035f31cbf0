// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/mapper.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/geometry/alignment.h"
#include "waymark/match/test_scene.h"
#include "waymark/simulate/motion.h"
#include "waymark/track/tracker.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr int kNumFrames = 60;
constexpr std::uint32_t kLatency = 2;

struct Setup {
  std::string name;
  int num_cameras;
  double inverse_range_sigma;
  bool has_range;
  double max_error_m;
};

void PrintTo(const Setup& setup, std::ostream* out) { *out << setup.name; }

struct Session {
  std::vector<FrameState> states;
  std::vector<RelativePose> poses;  ///< Per frame.
  std::vector<std::string> broken;  ///< After each message.
  std::shared_ptr<const Map> map;
};

/// A slow walk through a room, 20 frames per second.
Rigid3 truth(int frame) {
  static const Motion motion = make_motion("room", "loop", 20.0);
  return motion.world_from_rig(2.0 + 0.05 * frame);
}

/// Tracker and mapper by hand, with the map visible kLatency frames after each message.
Session run(const Setup& setup) {
  const auto rig = make_test_rig(setup.num_cameras);
  const PointCloud cloud = scatter_on(make_world("room", 2), 5000, 2.5, 7);
  PointNoise noise;
  noise.outlier_share = 0.1;
  noise.inverse_range_sigma = setup.inverse_range_sigma;
  noise.max_features = 600;
  TrackingSettings settings;
  settings.keyframe_parallax_px = 30.0;  // Several keyframes in a short walk.
  Tracker tracker(rig, setup.has_range, settings, 1);
  Mapper mapper(rig, MappingSettings{});
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const Map>>> published;
  std::shared_ptr<const Map> visible = std::make_shared<const Map>();
  Session session;
  for (std::uint32_t i = 0; i < kNumFrames; ++i) {
    while (!published.empty() && published.front().first <= i) {
      visible = published.front().second;
      published.erase(published.begin());
    }
    const PointObservation seen = observe(cloud, *rig, truth(static_cast<int>(i)), noise, i);
    StageTimes times;
    TrackOutcome outcome =
        tracker.track({FrameId{i}, 50'000'000 * std::int64_t{i}, seen.features}, visible, times);
    session.states.push_back(outcome.state);
    session.poses.push_back(outcome.pose.value_or(RelativePose{}));
    for (const FilledPose& filled : outcome.filled) {
      session.states[filled.frame.value] = FrameState::kFilled;
      session.poses[filled.frame.value] = filled.pose;
    }
    if (!outcome.message) continue;
    const bool is_submap = std::holds_alternative<NewSubmap>(*outcome.message);
    std::visit([&](const auto& message) { mapper.add(message); }, *outcome.message);
    session.broken.push_back(mapper.map().broken_invariants());
    published.push_back({i + (is_submap ? 1 : kLatency), mapper.freeze()});
  }
  mapper.refine_globally();
  session.broken.push_back(mapper.map().broken_invariants());
  session.map = mapper.freeze();
  return session;
}

Rigid3 world_from_rig(const Session& session, std::size_t frame) {
  const RelativePose& pose = session.poses[frame];
  return session.map->rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale)
      .inverse();
}

/// Root mean square distance of the positions after alignment; in mono with scale.
double trajectory_error(const Session& session, bool is_scale_free) {
  std::vector<Vector3d> estimated;
  std::vector<Vector3d> expected;
  for (std::size_t i = 0; i < session.poses.size(); ++i) {
    if (!session.poses[i].reference.is_valid()) continue;
    estimated.push_back(world_from_rig(session, i).translation);
    expected.push_back(truth(static_cast<int>(i)).translation);
  }
  std::optional<Sim3> alignment;
  if (is_scale_free) {
    alignment = align_similarity(estimated, expected);
  } else if (const auto rigid = align_rigid(estimated, expected)) {
    alignment = Sim3(*rigid);
  }
  if (!alignment) return INFINITY;
  double squares = 0.0;
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    squares += (*alignment * estimated[i] - expected[i]).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(estimated.size()));
}

class MapperSession : public ::testing::TestWithParam<Setup> {};

TEST_P(MapperSession, FollowsAWalkWithASoundMap) {
  const Session session = run(GetParam());
  for (const std::string& broken : session.broken) ASSERT_EQ(broken, "");
  ASSERT_GE(session.broken.size(), 4u) << "too few keyframes to test anything";
  int num_located = 0;
  for (std::size_t i = 0; i < session.states.size(); ++i) {
    EXPECT_NE(session.states[i], FrameState::kLost) << "frame " << i;
    num_located += session.poses[i].reference.is_valid();
  }
  EXPECT_GE(num_located, kNumFrames - 2);
  EXPECT_LT(trajectory_error(session, !GetParam().has_range), GetParam().max_error_m);
}

TEST_P(MapperSession, GivesTheSameBitsAgain) {
  const Session once = run(GetParam());
  const Session again = run(GetParam());
  ASSERT_EQ(once.states, again.states);
  ASSERT_EQ(once.map->keyframes().size(), again.map->keyframes().size());
  ASSERT_EQ(once.map->landmarks().size(), again.map->landmarks().size());
  for (std::size_t i = 0; i < once.poses.size(); ++i) {
    if (!once.poses[i].reference.is_valid()) continue;
    EXPECT_EQ(world_from_rig(once, i).matrix(), world_from_rig(again, i).matrix());
  }
  once.map->landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_EQ(landmark.position_in_world, again.map->landmarks().at(id).position_in_world);
  });
}

INSTANTIATE_TEST_SUITE_P(Setups,
                         MapperSession,
                         ::testing::Values(Setup{"mono", 1, 0.0, false, 0.05},
                                           Setup{"stereo", 2, 0.0, true, 0.02},
                                           Setup{"rgbd", 1, 0.01, true, 0.02}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace waymark

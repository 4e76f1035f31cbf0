// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/mapper.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/geometry/alignment.h"
#include "waymark/match/testing/scene.h"
#include "waymark/optimize/bundle.h"
#include "waymark/simulate/motion.h"
#include "waymark/track/testing/tracked.h"
#include "waymark/track/trajectory_memory.h"

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
};

void PrintTo(const Setup& setup, std::ostream* out) { *out << setup.name; }

struct Session {
  std::vector<FrameState> states;
  std::vector<RelativePose> poses;         ///< Per frame.
  std::vector<double> position_variances;  ///< Of the frames located in a map, in map units.
  std::vector<std::string> broken;         ///< After each message.
  std::shared_ptr<const Map> map;
};

/// A slow walk through a room, 20 frames per second.
Rigid3 truth(int frame) {
  static const Motion motion = make_motion("room", "loop", 20.0);
  return motion.world_from_rig(2.0 + 0.05 * frame);
}

PointCloud make_cloud() { return scatter_on(make_world("room", 2), 5000, 2.5, 7); }

PointNoise make_noise(const Setup& setup) {
  PointNoise noise;
  noise.outlier_share = 0.1;
  noise.inverse_range_sigma = setup.inverse_range_sigma;
  noise.max_features = 600;
  return noise;
}

/// Tracker and mapper by hand, with the map visible kLatency frames after each message.
Session run(const Setup& setup) {
  const auto rig = make_test_rig(setup.num_cameras);
  const PointCloud cloud = make_cloud();
  const PointNoise noise = make_noise(setup);
  TrackingSettings settings;
  settings.keyframe_parallax_px = 30.0;  // Several keyframes in a short walk.
  Tracker tracker(setup.has_range, settings, 1);
  Mapper mapper(rig, MappingSettings{});
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const Map>>> published;
  std::shared_ptr<const Map> visible = std::make_shared<const Map>();
  Session session;
  TrajectoryMemory memory;
  for (std::uint32_t i = 0; i < kNumFrames; ++i) {
    while (!published.empty() && published.front().first <= i) {
      visible = published.front().second;
      published.erase(published.begin());
    }
    const PointObservation seen = observe(cloud, rig, truth(static_cast<int>(i)), noise, i);
    const Frame frame{FrameId{i}, 50'000'000 * std::int64_t{i}, seen.features};
    Tracked outcome;
    outcome.message =
        tracker.track(frame, {visible, std::make_shared<const PlaceIndex>()}, outcome);
    memory.add(frame, outcome, *visible);
    if (outcome.num_inliers > 0 && !outcome.covariance.isZero()) {
      session.position_variances.push_back(outcome.covariance.topLeftCorner<3, 3>().trace());
    }
    if (!outcome.message) continue;
    const bool is_submap = std::holds_alternative<NewSubmap>(*outcome.message);
    std::visit([&](const auto& message) { mapper.add(message); }, *outcome.message);
    session.broken.push_back(mapper.map().broken_invariants());
    published.push_back({i + (is_submap ? 1 : kLatency), mapper.freeze()});
  }
  mapper.refine_globally(false);
  session.broken.push_back(mapper.map().broken_invariants());
  session.map = mapper.freeze();
  memory.settle(*rig, *session.map);
  for (const TrajectoryMemory::Entry& entry : memory.entries()) {
    session.states.push_back(entry.state);
    session.poses.push_back(entry.pose());
  }
  return session;
}

Rigid3 world_from_rig(const Session& session, std::size_t frame) {
  const RelativePose& pose = session.poses[frame];
  return session.map->rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale)
      .inverse();
}

/// Root mean square error of positions after alignment, in mono with scale, and what the scale is.
struct PositionError {
  double rmse_m = INFINITY;
  double scale = 1.0;
};

PositionError position_error(const std::vector<Vector3d>& estimated,
                             const std::vector<Vector3d>& expected,
                             bool is_scale_free) {
  std::optional<Sim3> alignment;
  if (is_scale_free) {
    alignment = align_similarity(estimated, expected);
  } else if (const auto rigid = align_rigid(estimated, expected)) {
    alignment = Sim3(*rigid);
  }
  if (!alignment) return {};
  double squares = 0.0;
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    squares += (*alignment * estimated[i] - expected[i]).squaredNorm();
  }
  return {std::sqrt(squares / static_cast<double>(estimated.size())), alignment->scale};
}

PositionError keyframe_error(const Session& session, bool is_scale_free) {
  std::vector<Vector3d> estimated, expected;
  session.map->keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    estimated.push_back(keyframe.rig_from_world.origin_in_source());
    expected.push_back(truth(static_cast<int>(keyframe.frame.value)).translation);
  });
  return position_error(estimated, expected, is_scale_free);
}

PositionError trajectory_error(const Session& session, bool is_scale_free) {
  std::vector<Vector3d> estimated, expected;
  for (std::size_t i = 0; i < session.poses.size(); ++i) {
    if (!session.poses[i].reference.is_valid()) continue;
    estimated.push_back(world_from_rig(session, i).translation);
    expected.push_back(truth(static_cast<int>(i)).translation);
  }
  return position_error(estimated, expected, is_scale_free);
}

/// Root mean square of the position error that the tracker's covariances announce, in map units.
double announced_error(const Session& session) {
  double sum = 0.0;
  for (const double variance : session.position_variances) sum += variance;
  return std::sqrt(sum / static_cast<double>(session.position_variances.size()));
}

/// All observations of all landmarks by a part of the frames, as only the simulator knows them, at
/// the true poses and points.
BundleProblem perfect_problem(const Setup& setup,
                              const std::shared_ptr<const Rig>& rig,
                              int every) {
  const PointCloud cloud = make_cloud();
  BundleProblem problem;
  std::vector<std::vector<BundleObservation>> observations(cloud.landmarks.size());
  for (int i = 0; i < kNumFrames; i += every) {
    const PointObservation seen =
        observe(cloud, rig, truth(i), make_noise(setup), static_cast<std::uint64_t>(i));
    for (std::uint32_t k = 0; k < seen.features->num_primary; ++k) {
      const std::uint32_t landmark = seen.landmark_of_feature[k];
      if (landmark == kNoLandmark) continue;
      const auto pose = static_cast<std::uint32_t>(problem.rig_from_world.size());
      observations[landmark].push_back({seen.features->measurement(k), pose});
    }
    problem.is_pose_fixed.push_back(problem.rig_from_world.empty());
    problem.rig_from_world.push_back(truth(i).inverse());
    problem.rigs.push_back(rig.get());
  }
  for (std::size_t landmark = 0; landmark < observations.size(); ++landmark) {
    if (observations[landmark].size() < 2) continue;
    for (BundleObservation& observation : observations[landmark]) {
      observation.point = static_cast<std::uint32_t>(problem.points.size());
      problem.observations.push_back(observation);
    }
    problem.points.push_back(cloud.landmarks[landmark].position);
  }
  return problem;
}

/// What the noise alone costs: the error after adjusting every fourth frame at once, with perfect
/// knowledge of who sees what. No mapper can be expected to do better.
double least_error(const Setup& setup) {
  constexpr int kEvery = 4;
  const auto rig = make_test_rig(setup.num_cameras);
  BundleProblem problem = perfect_problem(setup, rig, kEvery);
  adjust_bundle(problem, {.num_rounds = 1});
  std::vector<Vector3d> estimated, expected;
  for (std::size_t i = 0; i < problem.rig_from_world.size(); ++i) {
    estimated.push_back(problem.rig_from_world[i].origin_in_source());
    expected.push_back(truth(static_cast<int>(i) * kEvery).translation);
  }
  return position_error(estimated, expected, !setup.has_range).rmse_m;
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
  // Keyframes are nearly as good as the noise lets them be; the factor is for the alignment to few
  // of them. Frames between them have the error of their own view on top.
  const bool is_scale_free = !GetParam().has_range;
  const double least_m = least_error(GetParam());
  EXPECT_LT(keyframe_error(session, is_scale_free).rmse_m, 2.0 * least_m);
  const PositionError error = trajectory_error(session, is_scale_free);
  EXPECT_LT(error.rmse_m, 2.0 * std::hypot(least_m, error.scale * announced_error(session)));
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
                         ::testing::Values(Setup{"mono", 1, 0.0, false},
                                           Setup{"stereo", 2, 0.0, true},
                                           Setup{"rgbd", 1, 0.01, true}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace waymark

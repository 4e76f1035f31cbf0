// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/initializer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "waymark/features/range_precision.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

using Path = std::function<Rigid3(std::uint32_t)>;

/// What the frames of a path see.
struct Scene {
  std::shared_ptr<const Rig> rig;
  PointCloud cloud;
  PointNoise noise;
  Path world_from_rig;

  PointObservation look(std::uint32_t frame) const {
    return observe(cloud, rig, world_from_rig(frame), noise, frame);
  }
  Frame frame(std::uint32_t number) const {
    return {FrameId{number}, 50'000'000 * std::int64_t{number}, look(number).features};
  }
};

struct Started {
  std::optional<Initialization> start;
  std::uint32_t at = 0;
  FrameReason reason = FrameReason::kNone;
};

Started run(const Scene& scene, bool has_range, std::uint32_t num_frames) {
  Initializer initializer(has_range, 7);
  Started started;
  for (; started.at < num_frames; ++started.at) {
    started.start = initializer.add(scene.frame(started.at));
    started.reason = initializer.reason();
    if (started.start) break;
  }
  return started;
}

Scene mono_scene(Path path) {
  return {make_test_rig(1), cloud_ahead(), {.seed = 2, .outlier_share = 0.1}, std::move(path)};
}

Path sideways() {
  return [](std::uint32_t i) { return pose_at(0.04 * i, 0.002 * i, 0.01 * i, 0.002 * i); };
}

TEST(Initializer, MonoStartsThroughFastTurnsThatImagesTell) {
  // 84 px from frame to frame, more than is searched.
  const Scene scene =
      mono_scene([](std::uint32_t i) { return pose_at(0.15 * i, 0.0, 0.0, 0.2 * i - 0.4); });
  EXPECT_FALSE(run(scene, false, 8).start);
  Initializer initializer(false, 7);
  bool has_started = false;
  for (std::uint32_t i = 0; i < 8 && !has_started; ++i) {
    Frame frame = scene.frame(i);
    frame.image = far_image(*scene.rig->cameras[0].camera, scene.world_from_rig(i));
    has_started = initializer.add(frame).has_value();
  }
  EXPECT_TRUE(has_started);
}

TEST(Initializer, MonoStartsWithTheTrueMotionUpToScale) {
  const Scene scene = mono_scene(sideways());
  const Started started = run(scene, false, 40);
  ASSERT_TRUE(started.start);
  const NewSubmap& submap = started.start->submap;
  EXPECT_FALSE(submap.is_metric);
  ASSERT_EQ(submap.keyframes.size(), 2u);
  EXPECT_EQ(submap.keyframes[1].frame, FrameId{started.at});
  EXPECT_TRUE(submap.keyframes[0].rig_from_world.matrix().isIdentity(1e-12));
  EXPECT_EQ(started.start->rig_from_world.matrix(), submap.keyframes[1].rig_from_world.matrix());
  const Rigid3 world_from_first = scene.world_from_rig(submap.keyframes[0].frame.value);
  const Rigid3 truth = scene.world_from_rig(started.at).inverse() * world_from_first;
  const Rigid3& estimate = submap.keyframes[1].rig_from_world;
  EXPECT_LT(estimate.rotation.angularDistance(truth.rotation), 0.01);
  EXPECT_GT(estimate.translation.normalized().dot(truth.translation.normalized()), 0.995);

  // The landmarks lie where the points are, in units of their median distance.
  const double scale = truth.translation.norm() / estimate.translation.norm();
  const PointObservation first = scene.look(submap.keyframes[0].frame.value);
  std::vector<double> errors, distances;
  for (const InitialLandmark& landmark : submap.landmarks) {
    distances.push_back(landmark.position_in_world.norm());
    const std::uint32_t index = first.landmark_of_feature[landmark.features[0]];
    if (index == kNoLandmark) continue;
    const Eigen::Vector3d point =
        world_from_first.inverse() * scene.cloud.landmarks[index].position;
    errors.push_back((scale * landmark.position_in_world - point).norm() / point.norm());
  }
  std::sort(errors.begin(), errors.end());
  std::sort(distances.begin(), distances.end());
  EXPECT_NEAR(distances[distances.size() / 2], 1.0, 1e-9);
  ASSERT_GT(errors.size(), submap.landmarks.size() * 9 / 10);
  // 12 px of parallax with 0.5 px of noise in both views tell a distance to 6 %.
  EXPECT_LT(errors[errors.size() / 2], 0.06);
}

/// A camera that moves sideways, and in the first of its frames a box that has most of the features
/// and turns before it.
struct BoxInTheWay {
  static constexpr std::uint32_t kNumHidden = 12;
  Scene room = {make_test_rig(1), cloud_ahead(400), {.seed = 2}, sideways()};

  Frame frame(std::uint32_t number) const {
    Scene seen = room;
    if (number < kNumHidden) {
      const Rigid3 turned = pose_at(0.0, 0.0, 2.5, 0.03 * number);
      seen.cloud = with_box(seen.cloud, scatter_in({-1, -1, -1}, {1, 1, 1}, 1200, 3.0, 4), turned);
    }
    return seen.frame(number);
  }
  /// As a gyroscope without bias tells it.
  bool contradicts(std::uint32_t begin, std::uint32_t end, const Eigen::Quaterniond& turn) const {
    const Rigid3 truth = room.world_from_rig(end).inverse() * room.world_from_rig(begin);
    return turn.angularDistance(truth.rotation) > 0.01;
  }
};

std::optional<std::uint32_t> start_beside_box(bool has_gyroscope, bool is_gyroscope_wrong) {
  const BoxInTheWay scene;
  Initializer initializer(false, 7);
  for (std::uint32_t i = 0; i < 60; ++i) {
    Frame frame = scene.frame(i);
    if (has_gyroscope) {
      frame.contradicts_turn = [&, i](std::int64_t begin_ns, const auto& turn, double) {
        const auto begin = static_cast<std::uint32_t>(begin_ns / 50'000'000);
        return is_gyroscope_wrong || scene.contradicts(begin, i, turn);
      };
    }
    if (initializer.add(frame)) return i;
  }
  return std::nullopt;
}

TEST(Initializer, MonoDoesNotStartFromATurnThatAGyroscopeContradicts) {
  ASSERT_LT(start_beside_box(false, false).value(), BoxInTheWay::kNumHidden);
  EXPECT_GE(start_beside_box(true, false).value(), BoxInTheWay::kNumHidden);
}

TEST(Initializer, MonoStartsThoughAGyroscopeContradictsWhatever) {
  EXPECT_GT(start_beside_box(true, true).value(), 19u);
}

TEST(Initializer, MonoFillsTheFramesItSkipped) {
  const Scene scene = mono_scene(sideways());
  const Started started = run(scene, false, 40);
  ASSERT_TRUE(started.start);
  ASSERT_GT(started.at, 1u);
  const NewSubmap& submap = started.start->submap;
  const Rigid3 world_from_first = scene.world_from_rig(submap.keyframes[0].frame.value);
  const double scale =
      (scene.world_from_rig(started.at).inverse() * world_from_first).translation.norm() /
      submap.keyframes[1].rig_from_world.translation.norm();
  std::vector<bool> is_filled(started.at, false);
  for (const FilledPose& filled : started.start->filled) {
    ASSERT_LT(filled.frame.value, started.at);
    EXPECT_FALSE(is_filled[filled.frame.value]) << "twice: " << filled.frame.value;
    is_filled[filled.frame.value] = true;
    EXPECT_EQ(filled.pose.reference, KeyframeId{0});
    const Rigid3 truth = scene.world_from_rig(filled.frame.value).inverse() * world_from_first;
    Rigid3 estimate = filled.pose.rig_from_reference;
    estimate.translation *= scale;
    const Vector6d error = (estimate * truth.inverse()).log();
    EXPECT_LT(error.head<3>().norm(), 0.08) << filled.frame.value;
    EXPECT_LT(error.tail<3>().norm(), 0.012) << filled.frame.value;
  }
  EXPECT_EQ(std::count(is_filled.begin(), is_filled.end(), false), 0);
}

TEST(Initializer, MonoTellsHowTheRigMovedInItsKeyframes) {
  const Scene scene = mono_scene(
      [](std::uint32_t i) { return pose_at(0.06 * i, 0.002 * i, 0.0, 0.02 * i + 0.001 * i * i); });
  const Started started = run(scene, false, 40);
  ASSERT_TRUE(started.start);
  for (const InitialKeyframe& keyframe : started.start->submap.keyframes) {
    const RigMotion& motion = keyframe.features->motion;
    const double yaw_rad_s = (0.02 + 0.002 * keyframe.frame.value) / 0.05;
    EXPECT_NEAR(std::abs(motion.turn_rad_s.y()), yaw_rad_s, 0.1) << keyframe.frame.value;
    EXPECT_GT(motion.shift_per_s.norm(), 0.05f);
    EXPECT_EQ(motion.inverse_range, 1.0f);
    EXPECT_EQ(keyframe.features->keypoints[3].x_px,
              scene.look(keyframe.frame.value).features->keypoints[3].x_px)
        << "a global shutter";
  }
}

TEST(Initializer, MonoWaitsWhileTheCameraOnlyTurns) {
  const Scene scene = mono_scene([](std::uint32_t i) {
    return make_test_pose({0.0, 0.0, 0.0}, {0.0, 0.01 * i, 0.002 * i});
  });
  const Started started = run(scene, false, 25);
  EXPECT_FALSE(started.start);
  EXPECT_EQ(started.reason, FrameReason::kTooLittleParallax);
}

TEST(Initializer, MonoStartsOnceTurningBecomesMoving) {
  const Scene scene = mono_scene([](std::uint32_t i) {
    return i < 15 ? pose_at(0.0, 0.0, 0.0, 0.01 * i) : pose_at(0.05 * (i - 14), 0.0, 0.0, 0.15);
  });
  const Started started = run(scene, false, 50);
  ASSERT_TRUE(started.start);
  EXPECT_GE(started.at, 15u);
}

/// A box of points that somebody turns before a wall of them.
PointCloud box_before_wall(std::uint32_t frame) {
  return with_box(scatter_in({-5.0, -3.0, 5.0}, {5.0, 3.0, 5.5}, 600, 6.0, 3),
                  scatter_in({-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}, 250, 3.0, 4),
                  pose_at(0.01 * frame, 0.2, 3.5, 0.02 * frame));
}

TEST(Initializer, MonoWaitsForTheCameraToMoveWhateverMovesBeforeIt) {
  constexpr std::uint32_t kNumStill = 40;
  Scene scene = mono_scene(
      [](std::uint32_t i) { return i < kNumStill ? Rigid3{} : sideways()(i - kNumStill); });
  Initializer initializer(false, 7);
  std::uint32_t at = 0;
  for (std::optional<Initialization> start; at < kNumStill + 30 && !start; ++at) {
    scene.cloud = box_before_wall(at);
    start = initializer.add(scene.frame(at));
    if (start) break;
  }
  EXPECT_GT(at, kNumStill);
  EXPECT_LT(at, kNumStill + 30);
}

TEST(Initializer, MonoKeepsOnlySoManyFramesWhileTheCameraStandsStill) {
  const auto num_still = static_cast<std::uint32_t>(Initializer::kMaxPassed + 20);
  const Path path = sideways();
  Scene scene =
      mono_scene([&](std::uint32_t i) { return path(i < num_still ? 0 : i - num_still); });
  scene.noise.max_features = 130;
  Initializer initializer(false, 7);
  std::optional<Initialization> start;
  const auto still = scene.look(0).features;
  for (std::uint32_t i = 0; i < num_still; ++i) {
    ASSERT_FALSE(initializer.add({FrameId{i}, 50'000'000 * std::int64_t{i}, still}));
  }
  std::uint32_t at = num_still;
  for (; at < num_still + 40 && !start; ++at) start = initializer.add(scene.frame(at));
  ASSERT_TRUE(start);
  // The reference, and the newest of the others without a gap.
  const FrameId reference = start->submap.keyframes[0].frame;
  std::set<std::uint32_t> filled;
  for (const FilledPose& pose : start->filled) {
    if (pose.frame != reference) filled.insert(pose.frame.value);
  }
  EXPECT_EQ(start->filled.size(), filled.size() + 1);
  ASSERT_EQ(filled.size(), Initializer::kMaxPassed);
  EXPECT_EQ(*filled.begin(), at - 1 - Initializer::kMaxPassed);
  EXPECT_EQ(*filled.rbegin(), at - 2);
  // The camera stood still from the reference on.
  for (const FilledPose& pose : start->filled) {
    if (pose.frame.value >= num_still) continue;
    EXPECT_LT(pose.pose.rig_from_reference.log().norm(), 0.02) << pose.frame.value;
  }
}

TEST(Initializer, MonoRefusesViewsThatHaveNothingInCommon) {
  Scene scene = mono_scene(sideways());
  scene.world_from_rig = [](std::uint32_t i) { return pose_at(0.0, 0.0, 0.0, 2.1 * i); };
  scene.cloud = scatter_in({-9.0, -3.0, -9.0}, {9.0, 3.0, 9.0}, 6000, 6.0, 3);
  const Started started = run(scene, false, 3);
  EXPECT_FALSE(started.start);
  EXPECT_EQ(started.reason, FrameReason::kTooFewMatches);
}

TEST(Initializer, SaysWhenThereAreNoFeatures) {
  for (const bool has_range : {false, true}) {
    Scene scene = mono_scene(sideways());
    scene.rig = make_test_rig(has_range ? 2 : 1);
    scene.noise.max_features = 10;
    const Started started = run(scene, has_range, 3);
    EXPECT_FALSE(started.start);
    EXPECT_EQ(started.reason, FrameReason::kNoFeatures);
  }
}

TEST(Initializer, SameSeedSameBits) {
  const Started once = run(mono_scene(sideways()), false, 40);
  const Started again = run(mono_scene(sideways()), false, 40);
  ASSERT_TRUE(once.start && again.start);
  EXPECT_EQ(once.at, again.at);
  EXPECT_EQ(once.start->rig_from_world.matrix(), again.start->rig_from_world.matrix());
  ASSERT_EQ(once.start->submap.landmarks.size(), again.start->submap.landmarks.size());
}

Scene stereo_scene(double near_m) {
  PointCloud cloud =
      scatter_in({-near_m, -near_m / 2, near_m}, {near_m, near_m / 2, 2 * near_m}, 1500, near_m, 3);
  return {make_test_rig(2), std::move(cloud), {.seed = 2}, sideways()};
}

TEST(Initializer, RangeStartsAtOnceWithTheReliableOnes) {
  const Scene scene = stereo_scene(2.0);
  const Started started = run(scene, true, 1);
  ASSERT_TRUE(started.start);
  const NewSubmap& submap = started.start->submap;
  EXPECT_TRUE(submap.is_metric);
  ASSERT_EQ(submap.keyframes.size(), 1u);
  const PointObservation view = scene.look(0);
  std::size_t num_reliable = 0;
  for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
    num_reliable += has_reliable_range(*view.features, i);
  }
  EXPECT_EQ(submap.landmarks.size(), num_reliable);
  for (const InitialLandmark& landmark : submap.landmarks) {
    const std::uint32_t index = view.landmark_of_feature[landmark.features[0]];
    ASSERT_NE(index, kNoLandmark);
    const Eigen::Vector3d point =
        scene.world_from_rig(0).inverse() * scene.cloud.landmarks[index].position;
    // Reliable means 10 %; the noise here is nearly twice what the stereo search has.
    EXPECT_LT((landmark.position_in_world - point).norm(), 0.8 * point.norm());
  }
}

// 50 px per metre of inverse range: at 25 to 50 m, 1 to 2 px.
TEST(Initializer, ABaselineShortForTheSceneStillStarts) {
  Scene scene = stereo_scene(25.0);
  scene.noise.pixel_sigma = 0.15;
  const PointObservation view = scene.look(0);
  for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
    ASSERT_FALSE(has_reliable_range(*view.features, i));
  }
  const Started started = run(scene, true, 1);
  ASSERT_TRUE(started.start);
  EXPECT_TRUE(started.start->submap.is_metric);
  for (const InitialLandmark& landmark : started.start->submap.landmarks) {
    const std::optional<double> sigma = relative_range_sigma(*view.features, landmark.features[0]);
    ASSERT_TRUE(sigma);
    EXPECT_LT(*sigma, kFiniteRangeSigma);
  }
}

TEST(Initializer, RangeThatIsNotThereStartsNothing) {
  Scene scene = stereo_scene(2.0);
  scene.rig = make_test_rig(1);  // Features as of a stereo frame whose right image is black.
  const Started started = run(scene, true, 3);
  EXPECT_FALSE(started.start);
  EXPECT_EQ(started.reason, FrameReason::kTooFewMatches);
}

}  // namespace
}  // namespace waymark

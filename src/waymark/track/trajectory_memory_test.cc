// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/trajectory_memory.h"

#include <gtest/gtest.h>

#include "waymark/camera/perspective.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

class TrajectoryMemoryTest : public ::testing::Test {
 protected:
  TrajectoryMemoryTest() : scene_(1, cloud_ahead(), {.seed = 5}, false) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
    view_ = scene_.look(truth_, 100);
    memory_.add(frame(0), TrackingResult{}, scene_.map);  // What became the first keyframe.
  }

  /// Adds a frame that was located relative to the first keyframe when the map was smaller.
  void add_stale(std::uint32_t number, bool is_keyframe = false) {
    TrackingResult outcome;
    outcome.is_keyframe = is_keyframe;
    outcome.state = FrameState::kTracked;
    outcome.pose = RelativePose{KeyframeId{0}, 1.0, stale()};
    outcome.features = view_.features;
    outcome.landmarks = scene_.true_associations(view_);
    memory_.add(frame(number), outcome, scene_.map);
  }

  Frame frame(std::uint32_t number) const {
    return {FrameId{number}, std::int64_t{number} * 1000, view_.features};
  }

  Rigid3 stale() const {
    Rigid3 pose = truth_.inverse();
    pose.translation *= 0.9;
    return pose;
  }

  double error_m(std::uint32_t number) const { return error_m(memory_, number); }

  double error_m(const TrajectoryMemory& memory, std::uint32_t number) const {
    const RelativePose pose = memory.entries().at(number).pose();
    const Rigid3 rig_from_world =
        scene_.map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
    return (rig_from_world.origin_in_source() - truth_.translation).norm();
  }

  const Rigid3 truth_ = pose_at(0.3, 0.1, 0.2, 0.03);
  TestMap scene_;
  TrajectoryMemory memory_;
  PointObservation view_;
};

TEST_F(TrajectoryMemoryTest, SettlesFramesInTheFinalMap) {
  add_stale(1);
  add_stale(2);
  ASSERT_GT(error_m(2), 0.03);
  memory_.settle(*scene_.rig, scene_.map);
  EXPECT_LT(error_m(2), 0.01);
}

TEST_F(TrajectoryMemoryTest, SettlesFilledFramesByWhatTheirFeaturesShow) {
  memory_.add(frame(1), TrackingResult{}, scene_.map);
  memory_.add(frame(2), TrackingResult{}, scene_.map);
  TrackingResult start;
  start.state = FrameState::kTracked;
  start.pose = RelativePose{KeyframeId{1}, 1.0, Rigid3{}};
  start.filled = {{FrameId{2}, {KeyframeId{0}, 1.0, stale()}, view_.features}};
  memory_.add(frame(3), start, scene_.map);
  EXPECT_EQ(memory_.entries()[2].state, FrameState::kFilled);
  memory_.settle(*scene_.rig, scene_.map);
  EXPECT_LT(error_m(2), 0.01);
}

TEST_F(TrajectoryMemoryTest, FillsGapsFromBothSides) {
  memory_.add(frame(1), TrackingResult{}, scene_.map);
  memory_.add(frame(2), TrackingResult{}, scene_.map);
  add_stale(3);
  memory_.add(frame(4), TrackingResult{}, scene_.map);
  Frame blind = frame(5);
  blind.features = std::make_shared<const Features>();
  memory_.add(blind, TrackingResult{}, scene_.map);
  memory_.add(frame(6), TrackingResult{}, scene_.map);
  memory_.settle(*scene_.rig, scene_.map);
  for (const std::uint32_t number : {1u, 2u, 4u}) {
    EXPECT_EQ(memory_.entries()[number].state, FrameState::kFilled) << number;
    EXPECT_LT(error_m(number), 0.01) << number;
  }
  EXPECT_EQ(memory_.entries()[5].state, FrameState::kLost);
  EXPECT_EQ(memory_.entries()[6].state, FrameState::kLost) << "nothing known beside it";
}

TEST_F(TrajectoryMemoryTest, MeasuresWhatFramesSawAsCalibratedSince) {
  auto told = std::make_shared<Rig>(*scene_.rig);
  told->cameras[0].camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({380.0, 380.0}, {319.5, 239.5}), 640, 480);
  view_.features = recompute(*view_.features, told, {});
  add_stale(1);
  memory_.settle(*scene_.rig, scene_.map);
  EXPECT_LT(error_m(1), 0.01);
}

TEST_F(TrajectoryMemoryTest, StraightensWhatARollingShutterBentBeforeThatWasKnown) {
  auto rolling = std::make_shared<Rig>(*scene_.rig);
  rolling->cameras[0].readout_s = 0.03;
  auto upwards = std::make_shared<Rig>(*rolling);  // Corrected for that, an image is bent.
  upwards->cameras[0].readout_s = -0.03;
  RigMotion motion;
  motion.turn_rad_s = {1.0f, -0.8f, 0.5f};
  Features bent = *recompute(*view_.features, upwards, motion);
  bent.readout_s = {};
  bent.motion = {};
  view_.features = std::make_shared<const Features>(bent);
  const auto pose_ms = [&](double ms) {
    const Eigen::Vector3d turn = 1e-3 * ms * motion.turn_rad_s.cast<double>();
    return Rigid3::exp((Vector6d() << 0.0, 0.0, 0.0, turn).finished()) * truth_.inverse();
  };
  const auto settled_error_m = [&](const std::shared_ptr<const Rig>& rig) {
    TrajectoryMemory memory;
    memory.add(frame(0), TrackingResult{}, scene_.map);
    for (const double ms : {-30.0, 0.0, 50.0}) {
      TrackingResult outcome;
      outcome.state = FrameState::kTracked;
      outcome.pose = RelativePose{KeyframeId{0}, 1.0, pose_ms(ms)};
      outcome.features = view_.features;
      if (ms == 0.0) outcome.landmarks = scene_.true_associations(view_);
      Frame moment = frame(memory.next().value);
      moment.timestamp_ns = static_cast<std::int64_t>(1e6 * (1000.0 + ms));
      memory.add(moment, outcome, scene_.map);
    }
    const auto seen = memory.motion_in(FrameId{2}, scene_.map);
    EXPECT_TRUE(seen && (seen->turn_rad_s - motion.turn_rad_s).norm() < 1e-3f);
    EXPECT_FALSE(memory.motion_in(FrameId{7}, scene_.map));
    memory.settle(*rig, scene_.map);
    return error_m(memory, 2);
  };
  EXPECT_LT(settled_error_m(rolling), 0.01);
  EXPECT_GT(settled_error_m(scene_.rig), 0.02);
}

TEST_F(TrajectoryMemoryTest, LeavesKeyframesToTheMap) {
  TrackingResult outcome;
  outcome.state = FrameState::kTracked;
  outcome.pose = RelativePose{KeyframeId{1}, 1.0, Rigid3{}};
  outcome.features = view_.features;
  outcome.landmarks = scene_.true_associations(view_);
  memory_.add(frame(1), outcome, scene_.map);  // The second keyframe was made from frame 1.
  memory_.settle(*scene_.rig, scene_.map);
  EXPECT_EQ(memory_.entries()[1].pose().reference, KeyframeId{1});
  EXPECT_EQ(memory_.entries()[1].pose().rig_from_reference.translation.norm(), 0.0);
}

TEST_F(TrajectoryMemoryTest, SettlesTheOldestOnceThereAreMany) {
  memory_.add(frame(1), TrackingResult{}, scene_.map);
  for (std::uint32_t i = 0; i <= TrajectoryMemory::kMaxUnsettled; ++i) {
    add_stale(2 + i, i % TrajectoryMemory::kMaxSinceKeyframe == 0);
  }
  EXPECT_LT(error_m(2), 0.01);
  EXPECT_GT(error_m(3), 0.03);
}

TEST_F(TrajectoryMemoryTest, KeepsNothingOfFramesLongAfterAKeyframe) {
  constexpr std::uint32_t kLast = TrajectoryMemory::kMaxSinceKeyframe;
  memory_.add(frame(1), TrackingResult{}, scene_.map);
  for (std::uint32_t i = 0; i <= kLast + 1; ++i) add_stale(2 + i, i == 0);
  memory_.settle(*scene_.rig, scene_.map);
  EXPECT_LT(error_m(2 + kLast), 0.01);
  EXPECT_GT(error_m(2 + kLast + 1), 0.03);
}

}  // namespace
}  // namespace waymark

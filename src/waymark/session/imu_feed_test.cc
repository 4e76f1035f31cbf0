// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/imu_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/session/session.h"
#include "waymark/session/testing/memory_input.h"
#include "waymark/simulate/imu_device.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::MemoryInput;

constexpr int kNumTurned = 110;

/// A head that turns quickly, with an IMU upside down beside the camera; rendered once.
struct ImuRecording {
  Rig rig;
  std::vector<InputFrame> frames;
  std::vector<Rigid3> world_from_rig;
  Rigid3 imu_from_rig;
  ImuStream imu;
};

const ImuRecording& imu_recording() {
  static const ImuRecording made = [] {
    SequenceSpec spec;
    spec.chain = mono_chain(named_camera("perspective", 320));
    spec.motion = "turns_150";
    spec.num_frames = kNumTurned;
    spec.effects.noise_sigma = 2.0;
    spec.imu = parse_imu({"mems", "turn_x=180", "lever_y=5", "shift=4"});
    SimulatedSequence sequence(spec, std::thread::hardware_concurrency());
    ImuRecording recording;
    recording.imu_from_rig = *spec.imu->calibration().imu_from_rig;
    recording.imu.samples = sequence.imu_samples();
    recording.rig = sequence.rig();
    for (int i = 0; i < kNumTurned; ++i) {
      SimulatedFrame simulated = sequence.frame(i);
      InputFrame& frame = recording.frames.emplace_back();
      frame.index = static_cast<std::size_t>(i);
      frame.timestamp_ns = simulated.timestamp_ns;
      frame.images = std::move(simulated.images);
      recording.world_from_rig.push_back(simulated.world_from_rig);
    }
    return recording;
  }();
  return made;
}

SessionResults run_with(const ImuStream& imu,
                        Timing timing = Timing::kInline,
                        const std::vector<InputFrame>& frames = imu_recording().frames) {
  MemoryInput input(frames);
  input.info().imu = std::make_shared<const ImuStream>(imu);
  System system(imu_recording().rig, Settings(), timing);
  return run_session(input, system, {});
}

double length_of(const std::vector<StampedPose>& poses) {
  double length = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    length += (poses[i].world_from_camera.translation - poses[i - 1].world_from_camera.translation)
                  .norm();
  }
  return length;
}

TEST(ImuFeed, GivesMetresAndALevelMapAndFindsWhereTheImuIs) {
  const SessionResults results = run_with(imu_recording().imu);
  const InertialReport& imu = results.summary.imu.value();
  ASSERT_TRUE(imu.is_used) << imu.reason;
  EXPECT_TRUE(imu.metric_from);
  EXPECT_TRUE(results.summary.quality->is_metric);
  std::vector<StampedPose> truth;
  for (const Rigid3& pose : imu_recording().world_from_rig) truth.push_back({0, pose});
  const double ratio = length_of(results.trajectories.at(0)) / length_of(truth);
  EXPECT_NEAR(ratio, 1.0, 4.0 * imu.scale_sigma + 0.01);
  EXPECT_NEAR(imu.time_shift_s, 0.004, 0.001);
  EXPECT_LT(imu.imu_from_rig.rotation.angularDistance(imu_recording().imu_from_rig.rotation), 0.01);
  // Up is up: what was level in the truth is level in the map.
  const Rigid3& first = results.trajectories[0].front().world_from_camera;
  const std::size_t row = results.summary.counts.initialized_at.value();
  const Eigen::Vector3d up_in_rig =
      imu_recording().world_from_rig[row].rotation.conjugate() * Eigen::Vector3d::UnitZ();
  EXPECT_GT((first.rotation * up_in_rig).z(), std::cos(0.02));
}

/// Once it is sure the map is put into metres, from a frame on, as are poses then.
TEST(ImuFeed, PutsTheMapIntoMetresOnTheWay) {
  const ImuRecording& recording = imu_recording();
  System system(recording.rig, Settings(), Timing::kInline);
  std::size_t next = 0;
  std::vector<Rigid3> metric;
  for (const InputFrame& frame : recording.frames) {
    while (next < recording.imu.samples.size() &&
           recording.imu.samples[next].timestamp_ns < frame.timestamp_ns + 50'000'000) {
      system.feed_imu(recording.imu.samples[next++]);
    }
    FrameImages moment;
    moment.timestamp_ns = frame.timestamp_ns;
    moment.image0 = frame.images[0].view();
    const TrackingResult& result = system.feed(moment);
    if (!system.inertial() || !system.inertial()->metric_from) continue;
    ASSERT_TRUE(result.world_from_rig);
    EXPECT_GE(result.frame, *system.inertial()->metric_from);
    metric.push_back(*result.world_from_rig);
  }
  ASSERT_GT(metric.size(), 20U);
  const Rigid3 moved = metric.front().inverse() * metric.back();
  const std::vector<Rigid3>& truth = recording.world_from_rig;
  const Rigid3 true_moved = truth[truth.size() - metric.size()].inverse() * truth.back();
  EXPECT_LT((moved.translation - true_moved.translation).norm(),
            0.03 * true_moved.translation.norm());
  EXPECT_LT((system.inertial()->gravity_in_world - Eigen::Vector3d(0, 0, -9.80665)).norm(), 0.3);
  system.finish();
  EXPECT_EQ(system.inertial()->metric_from->value, truth.size() - metric.size());
}

/// How far a frame is from another one in the results and in the truth.
Rigid3 motion_error(const SessionResults& results, std::size_t from, std::size_t to) {
  const auto& poses = results.trajectories.at(0);
  const auto& truth = imu_recording().world_from_rig;
  const std::size_t before = results.summary.counts.frames - poses.size();  // Without a pose.
  const Rigid3 found =
      poses.at(from - before).world_from_camera.inverse() * poses.at(to - before).world_from_camera;
  return (truth.at(from).inverse() * truth.at(to)).inverse() * found;
}

TEST(ImuFeed, BridgesImagesThatShowNothing) {
  constexpr std::size_t kFirst = 78, kEnd = 90;
  std::vector<InputFrame> frames = imu_recording().frames;
  frames.resize(100);
  for (std::size_t i = kFirst; i < kEnd; ++i) {
    frames[i].images[0] = Image(frames[i].images[0].width_px, frames[i].images[0].height_px);
  }
  const SessionResults results = run_with(imu_recording().imu, Timing::kInline, frames);
  EXPECT_EQ(results.summary.counts.lost_count, 0u);
  EXPECT_EQ(results.trajectories.size(), 1u);
  for (std::size_t i = kFirst; i < kEnd; ++i) {
    EXPECT_EQ(results.table.frames[i].state, FrameState::kFilled);
    const Vector6d error = motion_error(results, kFirst - 1, i).log();
    EXPECT_LT(error.head<3>().norm(), 0.01) << i;
    EXPECT_LT(error.tail<3>().norm(), 0.005) << i;
  }
  // At the end there is no image to go back to.
  frames.resize(kEnd);
  const SessionResults without_end = run_with(imu_recording().imu, Timing::kInline, frames);
  EXPECT_EQ(without_end.summary.counts.tracked, results.summary.counts.tracked - (100 - kEnd));
  const Vector6d error = motion_error(without_end, kFirst - 1, kEnd - 1).log();
  EXPECT_LT(error.head<3>().norm(), 0.25);  // The bias of the accelerometer is not known yet.
  EXPECT_LT(error.tail<3>().norm(), 0.01);
}

TEST(ImuFeed, GivesTheSameBitsInlineAndInLockstep) {
  const SessionResults in_line = run_with(imu_recording().imu);
  const SessionResults lockstep = run_with(imu_recording().imu, Timing::kLockstep);
  ASSERT_EQ(in_line.trajectories.at(0).size(), lockstep.trajectories.at(0).size());
  for (std::size_t i = 0; i < in_line.trajectories[0].size(); ++i) {
    EXPECT_EQ(in_line.trajectories[0][i].world_from_camera.matrix(),
              lockstep.trajectories[0][i].world_from_camera.matrix());
  }
}

TEST(ImuFeed, LeavesOutWhatContradictsTheImages) {
  ImuStream swapped = imu_recording().imu;  // Axes of one sensor only.
  for (ImuSample& sample : swapped.samples) {
    std::swap(sample.angular_velocity.x(), sample.angular_velocity.y());
  }
  const SessionResults results = run_with(swapped);
  EXPECT_FALSE(results.summary.imu->is_used);
  EXPECT_THAT(results.summary.imu->reason, HasSubstr("contradicts"));
  EXPECT_FALSE(results.summary.quality->is_metric);
}

TEST(ImuFeed, LeavesOutAnAccelerometerWithLengthsOfItsOwn) {
  ImuStream long_units = imu_recording().imu;
  for (ImuSample& sample : long_units.samples) sample.acceleration *= 1.15;
  const SessionResults results = run_with(long_units);
  EXPECT_FALSE(results.summary.imu->is_used);
  EXPECT_THAT(results.summary.imu->reason, HasSubstr("its accelerometer is off"));
}

TEST(ImuFeed, DoesNotUseWhatIsWrongInItself) {
  ImuStream constant = imu_recording().imu;
  for (ImuSample& sample : constant.samples) sample.angular_velocity.setZero();
  const SessionResults results = run_with(constant);
  EXPECT_FALSE(results.summary.imu->is_used);
  EXPECT_THAT(results.summary.imu->reason, HasSubstr("always shows the same"));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// 360 degree cameras that turn: features cross the seam of the image and pass its poles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulated_run.h"
#include "waymark/simulate/named_cameras.h"

namespace waymark {
namespace {

constexpr int kHeightPx = 320;

/// Half a metre to the side, for a map, then full turns on the spot. turn_deg(phase) changes the
/// key that is the place.
template <class Turn>
Motion aside_then_turn(Turn turn) {
  constexpr int kNumAside = 8;
  constexpr int kNumTurning = 24;
  std::vector<MotionKey> keys;
  for (int i = 0; i <= kNumAside; ++i) {
    keys.push_back({{1.5, 1.3 + 0.5 * i / kNumAside, 1.5}, 0.0, 0.0, 0.0});
  }
  for (int i = 0; i <= kNumTurning; ++i) {
    MotionKey key = keys[kNumAside];
    turn(static_cast<double>(i) / kNumTurning, key);
    keys.push_back(key);
  }
  for (int i = 0; i < 3; ++i) keys.push_back(keys.back());
  return Motion(keys, 6.0);
}

void expect_tracked(const Motion& motion, double max_ate_m) {
  const Recording recording = simulate(named_camera("equirectangular", kHeightPx), motion);
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_GE(coverage(results), 0.98);
  EXPECT_EQ(results.summary.counts.lost_count, 0u);
  const double ate_m = evaluate_results(results, recording).ate_m.rmse;
  ::testing::Test::RecordProperty("ate_mm", std::to_string(1000.0 * ate_m));
  EXPECT_LT(ate_m, max_ate_m);
  // The orientation too: the angle between the first pose and each other is that of the truth.
  const auto& poses = results.trajectories.at(0);
  double worst_rad = 0.0;
  for (const StampedPose& pose : poses) {
    const auto truth = std::find_if(
        recording.groundtruth.begin(), recording.groundtruth.end(), [&](const StampedPose& other) {
          return other.timestamp_ns == pose.timestamp_ns;
        });
    ASSERT_NE(truth, recording.groundtruth.end());
    const auto first = std::find_if(
        recording.groundtruth.begin(), recording.groundtruth.end(), [&](const StampedPose& other) {
          return other.timestamp_ns == poses[0].timestamp_ns;
        });
    const Eigen::Quaterniond turned =
        poses[0].world_from_camera.rotation.conjugate() * pose.world_from_camera.rotation;
    const Eigen::Quaterniond expected =
        first->world_from_camera.rotation.conjugate() * truth->world_from_camera.rotation;
    worst_rad = std::max(worst_rad, turned.angularDistance(expected));
  }
  EXPECT_LT(worst_rad, 0.01);
}

TEST(WholeSphere, TurnsThroughTheSeam) {
  expect_tracked(aside_then_turn([](double phase, MotionKey& key) { key.yaw_deg = 400.0 * phase; }),
                 0.01);
}

TEST(WholeSphere, TumblesOverThePole) {
  expect_tracked(
      aside_then_turn([](double phase, MotionKey& key) { key.pitch_deg = 360.0 * phase; }), 0.005);
}

TEST(WholeSphere, RollsAboutItsAxis) {
  expect_tracked(
      aside_then_turn([](double phase, MotionKey& key) { key.roll_deg = -360.0 * phase; }), 0.005);
}

}  // namespace
}  // namespace waymark

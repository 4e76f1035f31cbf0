// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_path.h"

#include <gmock/gmock.h>

#include <cmath>

namespace waymark {
namespace {

constexpr std::int64_t kPeriodNs = 5'000'000;
constexpr double kTurn = 0.8;    // rad/s, about the axis of gravity.
constexpr double kRadius = 2.0;  // m
constexpr double kShift_s = 0.1;

/// On a circle, looking along z upwards; the IMU is at the rig, turned.
NavigationState truth(std::int64_t timestamp_ns) {
  const double angle = kTurn * 1e-9 * static_cast<double>(timestamp_ns);
  const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
  NavigationState state;
  state.timestamp_ns = timestamp_ns;
  state.world_from_rig = {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                          kRadius * out};
  state.velocity = kTurn * kRadius * Eigen::Vector3d(-out.y(), out.x(), 0.0);
  return state;
}

InertialReport report() {
  InertialReport report;
  report.gravity_in_world = {0.0, 0.0, -kStandardGravity};
  report.imu_from_rig.rotation = so3_exp({0.0, 0.5, 0.0});
  report.time_shift_s = kShift_s;
  return report;
}

ImuSamples circle_samples(int count) {
  ImuSamples samples;
  const Eigen::Quaterniond imu_from_rig = report().imu_from_rig.rotation;
  for (int i = 0; i < count; ++i) {
    samples.add({i * kPeriodNs + static_cast<std::int64_t>(1e9 * kShift_s),
                 imu_from_rig * Eigen::Vector3d(0.0, 0.0, kTurn),
                 imu_from_rig * Eigen::Vector3d(-kTurn * kTurn * kRadius, 0.0, kStandardGravity)});
  }
  return samples;
}

TEST(InertialPath, HasAMomentForEverySample) {
  const std::vector<NavigationState> frames{truth(20 * kPeriodNs), truth(60 * kPeriodNs)};
  const auto all = at_imu_rate(frames, circle_samples(100), report());
  ASSERT_EQ(all.size(), 41u);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const NavigationState expected = truth(static_cast<std::int64_t>(20 + i) * kPeriodNs);
    EXPECT_EQ(all[i].timestamp_ns, expected.timestamp_ns);
    EXPECT_LT((all[i].world_from_rig.inverse() * expected.world_from_rig).log().norm(), 1e-5);
    EXPECT_LT((all[i].velocity - expected.velocity).norm(), 1e-4);
  }
}

TEST(InertialPath, MeetsTheFramesHoweverFarOffTheSamplesLead) {
  std::vector<NavigationState> frames{truth(0), truth(40 * kPeriodNs)};
  const Rigid3 off(so3_exp({0.0, 0.01, 0.0}), {0.0, 0.0, 0.02});
  frames[1].world_from_rig = frames[1].world_from_rig * off;
  const auto all = at_imu_rate(frames, circle_samples(100), report());
  ASSERT_EQ(all.size(), 41u);
  const Vector6d left =
      (all[39].world_from_rig.inverse() * truth(39 * kPeriodNs).world_from_rig).log();
  EXPECT_NEAR(left.norm(), 39.0 / 40.0 * off.log().norm(), 1e-5);
}

TEST(InertialPath, KeepsFramesBetweenWhichSamplesAreMissing) {
  const std::vector<NavigationState> frames{truth(0), truth(500 * kPeriodNs)};
  EXPECT_EQ(at_imu_rate(frames, circle_samples(100), report()).size(), 2u);
}

}  // namespace
}  // namespace waymark

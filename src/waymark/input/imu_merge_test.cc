// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_merge.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(ImuMerge, InterpolatesTheAcceleration) {
  const std::vector<ImuSample> samples = merge_imu(
      {{5 * kMs, {1, 0, 0}}, {20 * kMs, {2, 0, 0}}, {25 * kMs, {3, 0, 0}}, {41 * kMs, {4, 0, 0}}},
      {{40 * kMs, {0, 0, 4}}, {10 * kMs, {0, 0, 1}}, {20 * kMs, {0, 0, 2}}, {30 * kMs, {0, 0, 3}}});
  ASSERT_EQ(samples.size(), 2U) << "nothing is made up before the first and after the last";
  EXPECT_EQ(samples[0].timestamp_ns, 20 * kMs);
  EXPECT_DOUBLE_EQ(samples[0].acceleration.z(), 2.0);
  EXPECT_DOUBLE_EQ(samples[1].acceleration.z(), 2.5);
  EXPECT_DOUBLE_EQ(samples[1].angular_velocity.x(), 3.0);
}

TEST(ImuMerge, DoesNotBridgeGaps) {
  std::vector<SensorReading> gyroscope, accelerometer;
  for (int i = 0; i < 100; ++i) {
    gyroscope.push_back({i * 5 * kMs, {0, 0, 0}});
    if (i < 20 || i > 60) accelerometer.push_back({i * 5 * kMs + 1, {0, 0, 9.8}});
  }
  const std::vector<ImuSample> samples = merge_imu(gyroscope, accelerometer);
  EXPECT_EQ(samples.size(), 19U + 38U);
  EXPECT_TRUE(merge_imu(gyroscope, {}).empty());
  EXPECT_TRUE(merge_imu({}, accelerometer).empty());
  EXPECT_TRUE(merge_imu(gyroscope, {{0, {0, 0, 1}}}).empty());
}

TEST(ImuMerge, TakesAnyTimes) {
  const std::vector<SensorReading> far = {{0, {0, 0, 0}}, {INT64_MAX, {0, 0, 1}}};
  EXPECT_EQ(merge_imu(far, far).size(), 2U);
  const std::vector<SensorReading> same = {{7, {0, 0, 0}}, {7, {0, 0, 1}}};
  EXPECT_EQ(merge_imu(same, same).size(), 2U);
}

}  // namespace
}  // namespace waymark

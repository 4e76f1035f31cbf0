// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_health.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

std::vector<ImuSample> moving_samples() {
  Rng rng(1, 0);
  const ImuSamples samples = testing::simulated_samples(testing::hand_held_motion(rng),
                                                        0.0,
                                                        10.0,
                                                        200.0,
                                                        {1e-4, 2e-3, 1e-5, 1e-4},
                                                        {},
                                                        {0.0, 0.0, -kStandardGravity},
                                                        rng);
  return {samples.all().begin(), samples.all().end()};
}

TEST(ImuHealth, OfGoodSamplesIsGood) {
  const ImuHealth health = imu_health(moving_samples());
  EXPECT_NEAR(health.rate_hz, 200.0, 1e-6);
  EXPECT_FALSE(health.gyroscope.is_constant);
  EXPECT_FALSE(health.accelerometer.is_constant);
  EXPECT_EQ(health.gyroscope.saturated_share, 0.0);
  EXPECT_EQ(health.accelerometer.saturated_share, 0.0);
}

TEST(ImuHealth, FindsAConstantSensor) {
  std::vector<ImuSample> samples = moving_samples();
  for (ImuSample& sample : samples) sample.acceleration = {0.0, 0.0, 9.81};
  const ImuHealth health = imu_health(samples);
  EXPECT_TRUE(health.accelerometer.is_constant);
  EXPECT_FALSE(health.gyroscope.is_constant);
}

TEST(ImuHealth, MeasuresTheShareOfSaturatedSamples) {
  std::vector<ImuSample> samples = moving_samples();
  const double range = 250.0 * M_PI / 180.0;
  std::size_t count = 0;
  for (ImuSample& sample : samples) {
    sample.angular_velocity *= 5.0;
    if (sample.angular_velocity.cwiseAbs().maxCoeff() >= range) ++count;
    sample.angular_velocity = sample.angular_velocity.cwiseMax(-range).cwiseMin(range);
  }
  ASSERT_GT(count, 20u);
  const double share = static_cast<double>(count) / static_cast<double>(samples.size());
  EXPECT_NEAR(imu_health(samples).gyroscope.saturated_share, share, 0.2 * share);
}

TEST(ImuHealth, AStillSensorOfFewBitsIsNotSaturated) {
  std::vector<ImuSample> samples = moving_samples();
  Rng rng(2, 0);
  for (ImuSample& sample : samples) {
    sample.acceleration = {0.0, 0.0, rng.uniform() < 0.5 ? 9.77 : 9.81};
  }
  EXPECT_EQ(imu_health(samples).accelerometer.saturated_share, 0.0);
  EXPECT_EQ(imu_health({}).rate_hz, 0.0);
}

}  // namespace
}  // namespace waymark

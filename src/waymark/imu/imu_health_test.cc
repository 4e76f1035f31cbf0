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
  EXPECT_TRUE(health.gaps.empty());
}

TEST(ImuHealth, FindsAConstantSensor) {
  std::vector<ImuSample> samples = moving_samples();
  for (ImuSample& sample : samples) sample.acceleration = {0.0, 0.0, 9.81};
  const ImuHealth health = imu_health(samples);
  EXPECT_TRUE(health.accelerometer.is_constant);
  EXPECT_FALSE(health.gyroscope.is_constant);
}

TEST(ImuHealth, FindsGaps) {
  std::vector<ImuSample> samples = moving_samples();
  samples.erase(samples.begin() + 1000, samples.begin() + 1010);
  const ImuHealth health = imu_health(samples);
  ASSERT_EQ(health.gaps.size(), 1U);
  EXPECT_EQ(health.gaps[0].start_ns, samples[999].timestamp_ns);
  EXPECT_EQ(health.gaps[0].duration_ns, 55'000'000);
  EXPECT_EQ(health.rest_s, 0.0);
  EXPECT_EQ(imu_health({}).rate_hz, 0.0);
}

/// How many of the stretches of .4 s show no motion.
double part_at_rest(const testing::ImuMotion& motion, const ImuNoise& noise) {
  Rng rng(2, 0);
  const ImuBiases biases{{0.02, -0.01, 0.03}, {0.1, 0.2, -0.3}};
  const ImuSamples samples = testing::simulated_samples(
      motion, 0.0, 20.0, 200.0, noise, biases, {0.0, 0.0, -kStandardGravity}, rng);
  int num_at_rest = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    num_at_rest += shows_no_motion(samples.all().subspan(80 * i, 80));
  }
  return num_at_rest / 50.0;
}

TEST(ImuHealth, ShowsNoMotionAtRestAlone) {
  const ImuNoise usual{1e-4, 2e-3, 1e-5, 1e-4};
  EXPECT_GT(part_at_rest({}, usual), 0.95);
  const ImuSample constant{0, {0.01, 0.0, 0.0}, {0.0, 0.0, kStandardGravity}};
  std::vector<ImuSample> not_connected(80, constant);
  for (std::size_t i = 0; i < 80; ++i) not_connected[i].timestamp_ns = 5'000'000 * std::int64_t(i);
  EXPECT_FALSE(shows_no_motion(not_connected));
  Rng rng(3, 0);
  EXPECT_EQ(part_at_rest(testing::hand_held_motion(rng), usual), 0.0);
  EXPECT_LT(part_at_rest(testing::hovering_motion(rng), usual), 0.1);
}

}  // namespace
}  // namespace waymark

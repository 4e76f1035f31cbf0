// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/base/rng.h"
#include "waymark/imu/imu_health.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

const Eigen::Vector3d kRestGravity(0.0, 0.0, -kStandardGravity);
const ImuBiases kRestBiases{{0.02, -0.01, 0.03}, {0.1, 0.1, -0.2}};

TEST(ImuNoise, OfARestIsThatOfTheSensor) {
  for (const double rate : {100.0, 200.0, 800.0}) {
    const ImuNoise truth{1.5e-4, 2e-3, 2e-5, 1e-4};
    Rng rng(1, 0);
    const ImuSamples samples =
        testing::simulated_samples({}, 0.0, 8.0, rate, truth, kRestBiases, kRestGravity, rng);
    const auto found = imu_health(samples.all()).noise;
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->gyroscope / truth.gyroscope, 1.05, 0.12) << rate;
    EXPECT_NEAR(found->accelerometer / truth.accelerometer, 1.05, 0.12) << rate;
    EXPECT_EQ(found->gyroscope_walk, default_imu_noise().gyroscope_walk);
  }
}

TEST(ImuNoise, IsNotHiddenByAFilter) {
  const ImuNoise truth{3e-4, 4e-3, 2e-5, 1e-4};
  Rng rng(2, 0);
  const ImuSamples sharp =
      testing::simulated_samples({}, 0.0, 10.0, 400.0, truth, kRestBiases, kRestGravity, rng);
  ImuSamples smooth;
  ImuSample last = sharp.all().front();
  for (ImuSample sample : sharp.all()) {  // A low-pass filter of 5 ms or so.
    sample.angular_velocity = 0.6 * last.angular_velocity + 0.4 * sample.angular_velocity;
    sample.acceleration = 0.6 * last.acceleration + 0.4 * sample.acceleration;
    smooth.add(last = sample);
  }
  const auto found = imu_health(smooth.all()).noise;
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->gyroscope / truth.gyroscope, 1.0, 0.2);
  EXPECT_NEAR(found->accelerometer / truth.accelerometer, 1.0, 0.2);
}

TEST(ImuNoise, ComesFromTheRestAloneAndNotFromMotion) {
  const ImuNoise truth{1.5e-4, 2e-3, 2e-5, 1e-4};
  Rng rng(3, 0);
  const testing::ImuMotion motion = testing::hand_held_motion(rng);
  ImuSamples moving =
      testing::simulated_samples(motion, 0.0, 10.0, 200.0, truth, kRestBiases, kRestGravity, rng);
  EXPECT_FALSE(imu_health(moving.all()).noise);
  const ImuSamples rest =
      testing::simulated_samples({}, 10.5, 18.0, 200.0, truth, kRestBiases, kRestGravity, rng);
  for (const ImuSample& sample : rest.all()) moving.add(sample);
  const auto found = imu_health(moving.all()).noise;
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->gyroscope / truth.gyroscope, 1.05, 0.15);
  EXPECT_NEAR(found->accelerometer / truth.accelerometer, 1.05, 0.15);
}

TEST(ImuNoise, ShowsWhateverTheMotion) {
  const ImuNoise truth{1.5e-4, 2e-3, 2e-5, 1e-4};
  Rng rng(5, 0);
  const testing::ImuMotion motion = testing::hand_held_motion(rng);
  const ImuSamples samples =
      testing::simulated_samples(motion, 0.0, 10.0, 200.0, truth, kRestBiases, kRestGravity, rng);
  const ImuNoise shown = shown_imu_noise(samples.all());
  EXPECT_NEAR(shown.gyroscope / truth.gyroscope, 1.0, 0.25);
  EXPECT_NEAR(shown.accelerometer / truth.accelerometer, 1.0, 0.25);
}

TEST(ImuNoise, OfAConstantOutputIsNotZero) {
  Rng rng(4, 0);
  const ImuSamples samples =
      testing::simulated_samples({}, 0.0, 8.0, 200.0, {}, kRestBiases, kRestGravity, rng);
  const auto found = imu_health(samples.all()).noise;
  ASSERT_TRUE(found);
  EXPECT_GT(found->gyroscope, 0.0);
  EXPECT_GT(found->accelerometer, 0.0);
  EXPECT_FALSE(imu_health({}).noise);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kSampleStepNs = 5'000'000;

/// So many samples of an IMU with noise, the first half at rest.
ImuStream some_stream(int count) {
  ImuStream stream;
  stream.source = "imu.csv";
  Rng rng(1, 0);
  for (int i = 0; i < count; ++i) {
    const double turn = i < count / 2 ? 0.0 : std::sin(0.1 * i);
    const auto noise = [&](double sigma) {
      return Eigen::Vector3d(sigma * rng.normal(), sigma * rng.normal(), sigma * rng.normal());
    };
    stream.samples.push_back({i * kSampleStepNs,
                              Eigen::Vector3d(turn, 0, 0) + noise(0.002),
                              Eigen::Vector3d(0, 0, 9.81) + noise(0.02)});
  }
  return stream;
}

constexpr std::int64_t kMs = 1'000'000;

TEST(ImuStream, SortsAndCounts) {
  std::vector<SensorReading> readings;
  for (int i = 0; i < 10; ++i) readings.push_back({i * kMs, {0.1, 0.2, 0.3 * i}});
  std::swap(readings[2], readings[5]);
  readings.push_back(readings[4]);
  const ImuStream stream = merge_imu(readings, readings, "a");
  ASSERT_EQ(stream.samples.size(), 10U);
  EXPECT_EQ(stream.num_doubles, 1U);
  EXPECT_EQ(stream.num_out_of_order, 4U);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(stream.samples[i].timestamp_ns, static_cast<int>(i) * kMs);
  }
}

TEST(ImuStream, InterpolatesTheAccelerationOfAnotherSensor) {
  const ImuStream stream = merge_imu(
      {{5 * kMs, {1, 0, 0}}, {20 * kMs, {2, 0, 0}}, {25 * kMs, {3, 0, 0}}, {41 * kMs, {4, 0, 0}}},
      {{40 * kMs, {0, 0, 4}}, {10 * kMs, {0, 0, 1}}, {20 * kMs, {0, 0, 2}}, {30 * kMs, {0, 0, 3}}},
      "a");
  ASSERT_EQ(stream.samples.size(), 2U) << "nothing is made up before the first and after the last";
  EXPECT_EQ(stream.samples[0].timestamp_ns, 20 * kMs);
  EXPECT_DOUBLE_EQ(stream.samples[0].acceleration.z(), 2.0);
  EXPECT_DOUBLE_EQ(stream.samples[1].acceleration.z(), 2.5);
  EXPECT_DOUBLE_EQ(stream.samples[1].angular_velocity.x(), 3.0);
}

TEST(ImuStream, DoesNotBridgeGapsOfAnotherSensor) {
  std::vector<SensorReading> gyroscope, accelerometer;
  for (int i = 0; i < 100; ++i) {
    gyroscope.push_back({i * 5 * kMs, {0, 0, 0}});
    if (i < 20 || i > 60) accelerometer.push_back({i * 5 * kMs + 1, {0, 0, 9.8}});
  }
  EXPECT_EQ(merge_imu(gyroscope, accelerometer, "a").samples.size(), 19U + 38U);
  EXPECT_THROW(merge_imu(gyroscope, {}, "a"), InputError);
  EXPECT_THROW(merge_imu({}, accelerometer, "a"), InputError);
  const std::vector<SensorReading> far = {{0, {0, 0, 0}}, {INT64_MAX, {0, 0, 1}}};
  EXPECT_EQ(merge_imu(far, far, "a").samples.size(), 2U);
}

TEST(ImuStream, IsToldOf) {
  ImuStream stream = some_stream(4000);
  stream.num_out_of_order = 1000;
  stream.calibration.time_shift_s = 0.01;
  const std::string text = format_imu(stream, {0, 10'000'000'000});
  EXPECT_THAT(text, HasSubstr("inertial data: imu.csv\n  4000 samples over 19.995 s, 200.0 per"));
  EXPECT_THAT(text, HasSubstr("note: 1000 samples out of order are sorted in\n"));
  EXPECT_THAT(text, HasSubstr("it is not used: so many samples are out of order as those of two"));
  EXPECT_THAT(text, HasSubstr("gaps: 0"));
  EXPECT_THAT(text, HasSubstr("at rest for"));
  EXPECT_THAT(text, HasSubstr("images are 0.01 s later"));
  EXPECT_THAT(text, Not(HasSubstr("another clock")));
  EXPECT_THAT(format_imu(stream, {INT64_MAX - 5, INT64_MAX}), HasSubstr("another clock"));
  EXPECT_THAT(format_imu(stream, {19'000'000'000, 39'000'000'000}),
              HasSubstr("only 0.995 s of the images' 20.000 s"));
}

}  // namespace
}  // namespace waymark

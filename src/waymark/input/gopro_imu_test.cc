// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "waymark/base/testing/errors.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu_health.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/testing/gpmf_writer.h"

namespace waymark {
namespace {

using ::testing::Contains;
using testing::gpmf_element;
using testing::gpmf_imu_payload;
using ::testing::HasSubstr;

TEST(GoproImu, SpreadsSamplesOverPackets) {
  // One packet of three was lost.
  const std::vector<TelemetryPacket> packets = {{0.0, 1.0, gpmf_imu_payload(200, 0)},
                                                {2.0, 1.0, gpmf_imu_payload(200, 400)},
                                                {3.0, 0.5, gpmf_imu_payload(100, 600)}};
  const std::optional<ImuStream> stream = imu_of_gopro(packets, "a.mp4");
  ASSERT_TRUE(stream);
  ASSERT_EQ(stream->samples.size(), 500U);
  EXPECT_NEAR(stream->samples[100].timestamp_ns, 500'000'000, 10);
  EXPECT_NEAR(stream->samples[200].timestamp_ns, 2'000'000'000, 10);
  EXPECT_NEAR(stream->samples[499].timestamp_ns, 3'495'000'000, 10);
  const ImuHealth health = imu_health(stream->samples);
  EXPECT_NEAR(health.rate_hz, 200.0, 1e-3);
  EXPECT_EQ(health.gaps.size(), 1U);
  // Channels are Z up, X left, Y back.
  const ImuSample& sample = stream->samples[7];
  EXPECT_LT((sample.angular_velocity - Eigen::Vector3d(-2, -1, -3)).norm(), 1e-9);
  EXPECT_LT((sample.acceleration - Eigen::Vector3d(0, -9.8, 0)).norm(), 1e-9);
}

TEST(GoproImu, TakesAxesAsTold) {
  const auto with = [](const std::string& axes) { return gpmf_element("ORIN", 'c', 1, axes); };
  std::vector<TelemetryPacket> packets = {{0.0, 1.0, gpmf_imu_payload(100, 0, with("XzY"))},
                                          {1.0, 1.0, gpmf_imu_payload(100, 100, with("XzY"))}};
  const std::optional<ImuStream> stream = imu_of_gopro(packets, "a.mp4");
  ASSERT_TRUE(stream);
  const ImuSample& sample = stream->samples[0];
  EXPECT_LT((sample.angular_velocity - Eigen::Vector3d(-1, 2, -3)).norm(), 1e-9);
  packets[0].bytes = gpmf_imu_payload(100, 0, with("XZY"));
  EXPECT_THAT(testing::input_error_of([&] { imu_of_gopro(packets, "a.mp4"); }),
              HasSubstr("a.mp4: has axes 'XZY', expected those of a right-handed frame"));
  EXPECT_FALSE(imu_of_gopro({}, "a.mp4"));
  packets = {{0.0, 1.0, "nothing"}};
  EXPECT_FALSE(imu_of_gopro(packets, "a.mp4"));
}

/// A camera that shakes, whose images do not: they turn a third as far. Its samples have a clock of
/// their own.
TEST(GoproImu, TurnsWithImagesThatAreStabilized) {
  constexpr double kOffsetS = 0.021;
  const Eigen::Vector3d axis(0.6, 0.0, 0.8);
  const auto angle = [](double t) { return 0.3 * std::sin(5.0 * t); };
  const auto rate = [](double t) { return 1.5 * std::cos(5.0 * t); };
  std::vector<StampedRotation> camera_from_start, image_from_camera;
  for (int i = 0; i < 90; ++i) {
    const double t = i / 30.0;
    const std::int64_t time_ns = std::llround(1e9 * t);
    camera_from_start.push_back({time_ns, so3_exp(-angle(t) * axis)});
    image_from_camera.push_back({time_ns, so3_exp(2.0 / 3.0 * angle(t) * axis)});
  }
  std::vector<ImuSample> samples;
  for (int i = 0; i < 600; ++i) {
    const double t = i / 200.0;
    samples.push_back({std::llround(1e9 * (t + kOffsetS)),
                       rate(t) * axis,
                       so3_exp(-angle(t) * axis) * Eigen::Vector3d(0.0, -9.8, 0.0)});
  }
  const std::vector<ImuSample> given = samples;
  ASSERT_TRUE(turn_with_images(camera_from_start, image_from_camera, samples));
  ASSERT_GT(samples.size(), 550U);
  for (const ImuSample& sample : samples) {
    const double t = 1e-9 * static_cast<double>(sample.timestamp_ns);
    EXPECT_LT((sample.angular_velocity - rate(t) / 3.0 * axis).norm(), 0.1);
    const Eigen::Vector3d up = so3_exp(-angle(t) / 3.0 * axis) * Eigen::Vector3d(0.0, -9.8, 0.0);
    EXPECT_LT((sample.acceleration - up).norm(), 0.05);
  }
  // Orientations in other axes are not believed.
  for (StampedRotation& camera : camera_from_start) camera.rotation = camera.rotation.conjugate();
  samples = given;
  EXPECT_FALSE(turn_with_images(camera_from_start, image_from_camera, samples));
  EXPECT_EQ(samples.size(), given.size());
}

TEST(GoproImu, AgreesWithGravityOfTheCamera) {
  const char* data = std::getenv("WAYMARK_DATA");
  const auto video = std::filesystem::path(data ? data : "") / "gopro_max_imu" / "video.mp4";
  if (!data || !std::filesystem::exists(video)) GTEST_SKIP() << "WAYMARK_DATA has no gopro_max_imu";
  if (!is_video_file(video)) GTEST_SKIP() << "built without video";
  const std::optional<ImuStream> stream = imu_of_videos({video});
  ASSERT_TRUE(stream);
  const ImuHealth health = imu_health(stream->samples);
  EXPECT_NEAR(health.rate_hz, 197.5, 1.0);
  EXPECT_TRUE(health.gaps.empty());
  EXPECT_NEAR(health.accelerometer.mean_length, 9.83, 0.02);
  EXPECT_THAT(stream->notes, Contains(HasSubstr("samples are turned as its images are")));
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : stream->samples) up += sample.acceleration;
  Eigen::Vector3d down = Eigen::Vector3d::Zero();  // x right, y down, z forward.
  for (const TelemetryPacket& packet : read_telemetry(video)) {
    std::vector<double> gravity, images;
    for (const GpmfStream& of : parse_gpmf(packet.bytes)) {
      if (of.key == "GRAV") gravity = of.values;
      if (of.key == "IORI") images = of.values;
    }
    ASSERT_EQ(gravity.size() / 3, images.size() / 4);
    for (std::size_t i = 0; 3 * i < gravity.size(); ++i) {
      const double* q = &images[4 * i];
      down += Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * Eigen::Vector3d(&gravity[3 * i]);
    }
  }
  EXPECT_GT(-up.normalized().dot(down.normalized()), std::cos(0.02));
}

}  // namespace
}  // namespace waymark

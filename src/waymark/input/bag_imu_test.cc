// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "waymark/bag/testing/bag_writer.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using testing::WrittenMessage;

constexpr std::int64_t kFirstImuNs = 1'700'000'000'000'000'000;
constexpr std::int64_t kImuStepNs = 5'000'000;

void add(std::vector<WrittenMessage>& messages,
         const std::string& topic,
         RosEncoding encoding,
         std::int64_t time_ns,
         const RosImu& imu) {
  messages.push_back(
      {topic, "sensor_msgs/Imu", time_ns + 1000, testing::write_message(encoding, time_ns, imu)});
}

std::int64_t header_time(const BagMessage& message) { return message.timestamp_ns; }

TEST(BagImu, IsReadInAllFormats) {
  const TemporaryFolder folder;
  std::vector<WrittenMessage> ros1, ros2;
  for (int i = 0; i < 10; ++i) {
    const RosImu imu{{0.1, 0.2, 0.3}, {0, 0, 9.0 + 0.1 * i}};
    add(ros1, "/imu", RosEncoding::kRos1, kFirstImuNs + i * kImuStepNs, imu);
    add(ros2, "/imu", RosEncoding::kCdr, kFirstImuNs + i * kImuStepNs, imu);
    add(ros2, "/other", RosEncoding::kCdr, kFirstImuNs + i * kImuStepNs, {{}, {0, 0, 1}});
  }
  testing::write_bytes(folder / "a.bag", testing::make_ros1_bag(ros1, Compression::kLz4));
  testing::write_bytes(folder / "a.mcap", testing::make_mcap(ros2, Compression::kZstd));
  testing::write_sqlite_bag(folder / "a.db3", ros2);
  for (const char* name : {"a.bag", "a.mcap", "a.db3"}) {
    const std::optional<ImuStream> stream = imu_of_bag(Bag(folder / name), header_time);
    ASSERT_TRUE(stream) << name;
    EXPECT_EQ(stream->source, "/imu");
    ASSERT_EQ(stream->samples.size(), 10U) << name;
    EXPECT_EQ(stream->samples[9].timestamp_ns, kFirstImuNs + 9 * kImuStepNs);
    EXPECT_EQ(stream->samples[9].angular_velocity, Eigen::Vector3d(0.1, 0.2, 0.3));
    EXPECT_DOUBLE_EQ(stream->samples[9].acceleration.z(), 9.9);
    const bool has_other = name[2] != 'b';
    if (has_other) {
      EXPECT_THAT(stream->notes, Contains("note: /other is not used"));
    }
  }
}

TEST(BagImu, OfTwoTopicsIsBroughtTogether) {
  const TemporaryFolder folder;
  std::vector<WrittenMessage> messages;
  for (int i = 0; i < 10; ++i) {
    const std::int64_t time_ns = kFirstImuNs + i * kImuStepNs;
    add(messages, "/gyro/sample", RosEncoding::kCdr, time_ns, {{1, 0, 0}, {}, true, false});
    if (i % 3 > 0) continue;
    add(messages, "/accel/sample", RosEncoding::kCdr, time_ns, {{}, {0, 0, 9.8}, false, true});
  }
  testing::write_bytes(folder / "a.mcap", testing::make_mcap(messages));
  const std::optional<ImuStream> stream = imu_of_bag(Bag(folder / "a.mcap"), header_time);
  ASSERT_TRUE(stream);
  EXPECT_EQ(stream->source, "/gyro/sample and /accel/sample");
  ASSERT_EQ(stream->samples.size(), 10U);
  EXPECT_DOUBLE_EQ(stream->samples[4].acceleration.z(), 9.8);
  EXPECT_DOUBLE_EQ(stream->samples[4].angular_velocity.x(), 1.0);

  std::erase_if(messages, [](const auto& message) { return message.topic == "/gyro/sample"; });
  testing::write_bytes(folder / "b.mcap", testing::make_mcap(messages));
  const Bag half(folder / "b.mcap");
  EXPECT_THAT(testing::input_error_of([&] { imu_of_bag(half, header_time); }),
              HasSubstr("/accel/sample: has no turns and accelerations"));
}

}  // namespace
}  // namespace waymark

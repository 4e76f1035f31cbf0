// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A bag of ROS gives the same map, to the bit, as a folder with its images.
#include <gtest/gtest.h>

#include "simulated_run.h"
#include "waymark/bag/testing/bag_writer.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

std::vector<testing::WrittenMessage> messages_of(const Recording& recording, RosEncoding encoding) {
  std::vector<testing::WrittenMessage> messages;
  for (const InputFrame& frame : recording.frames) {
    const Image& image = frame.images.at(0);
    const std::string pixels(image.values.begin(), image.values.end());
    const auto width = static_cast<std::uint32_t>(image.width_px);
    const auto height = static_cast<std::uint32_t>(image.height_px);
    messages.push_back(
        {"/camera/image_raw",
         "sensor_msgs/Image",
         frame.timestamp_ns,
         testing::write_message(encoding,
                                frame.timestamp_ns,
                                RosImage{"f", height, width, "mono8", false, width, pixels})});
  }
  return messages;
}

void write_folder(const testing::TemporaryFolder& folder, const Recording& recording) {
  std::string times;
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    folder.write("images/" + std::to_string(i) + ".png",
                 encode_png(recording.frames[i].images.at(0)));
    times += format_seconds(recording.frames[i].timestamp_ns) + "\n";
  }
  folder.write("times.txt", times);
}

SessionResults map_input(Recording recording, const std::filesystem::path& path) {
  recording.frames.clear();
  const auto input = open_input(path, {});
  while (auto frame = input->next()) recording.frames.push_back(*std::move(frame));
  return map_recording(recording, Timing::kInline);
}

TEST(BagRun, GivesTheBitsOfTheFolder) {
  Recording recording = simulate(small_sequence(Setup::kMono, 40));
  // No time of a header is 0.
  for (InputFrame& frame : recording.frames) frame.timestamp_ns += 1'000'000'000;
  const testing::TemporaryFolder folder;
  write_folder(folder, recording);
  const SessionResults expected = map_input(recording, folder.path());
  EXPECT_GT(coverage(expected), 0.9);

  const testing::TemporaryFolder bags;
  const auto ros2 = messages_of(recording, RosEncoding::kCdr);
  testing::write_bytes(bags / "a.mcap", testing::make_mcap(ros2, Compression::kZstd));
  EXPECT_EQ(hash_of(map_input(recording, bags / "a.mcap")), hash_of(expected));
  testing::write_sqlite_bag(bags / "a.db3", ros2);
  EXPECT_EQ(hash_of(map_input(recording, bags / "a.db3")), hash_of(expected));
  const auto ros1 = messages_of(recording, RosEncoding::kRos1);
  testing::write_bytes(bags / "a.bag", testing::make_ros1_bag(ros1, Compression::kBz2));
  EXPECT_EQ(hash_of(map_input(recording, bags / "a.bag")), hash_of(expected));
}

}  // namespace
}  // namespace waymark

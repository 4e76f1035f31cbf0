// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/bag.h"

#include <gmock/gmock.h>

#include "waymark/bag/testing/bag_writer.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::IsEmpty;
using testing::make_mcap;
using testing::make_ros1_bag;
using testing::TemporaryFolder;
using testing::write_bytes;
using testing::write_message;
using testing::write_sqlite_bag;
using testing::WrittenMessage;

constexpr std::int64_t kSecond = 1'000'000'000;

/// Images of two topics and an IMU, recorded 5 ms after their time.
std::vector<WrittenMessage> some_messages(RosEncoding encoding) {
  std::vector<WrittenMessage> messages;
  for (int i = 0; i < 5; ++i) {
    const std::int64_t time_ns = 10 * kSecond + i * kSecond / 20;
    for (const char* topic : {"/left/image_raw", "/right/image_raw"}) {
      const std::string pixels(6, static_cast<char>('a' + i));
      messages.push_back(
          {topic,
           "sensor_msgs/Image",
           time_ns + 5'000'000,
           write_message(encoding, time_ns, RosImage{"f", 2, 3, "mono8", false, 3, pixels})});
    }
    messages.push_back({"/imu", "sensor_msgs/Imu", time_ns, "not looked at"});
  }
  return messages;
}

struct WrittenFormat {
  const char* name;
  RosEncoding encoding;
  void (*write)(const std::filesystem::path&, const std::vector<WrittenMessage>&);
};

template <Compression kCompression>
void write_mcap(const std::filesystem::path& path, const std::vector<WrittenMessage>& messages) {
  write_bytes(path, make_mcap(messages, kCompression));
}

template <Compression kCompression>
void write_ros1(const std::filesystem::path& path, const std::vector<WrittenMessage>& messages) {
  write_bytes(path, make_ros1_bag(messages, kCompression));
}

constexpr WrittenFormat kFormats[] = {
    {"a.mcap", RosEncoding::kCdr, write_mcap<Compression::kNone>},
    {"b.mcap", RosEncoding::kCdr, write_mcap<Compression::kLz4>},
    {"c.mcap", RosEncoding::kCdr, write_mcap<Compression::kZstd>},
    {"d.bag", RosEncoding::kRos1, write_ros1<Compression::kNone>},
    {"e.bag", RosEncoding::kRos1, write_ros1<Compression::kLz4>},
    {"f.bag", RosEncoding::kRos1, write_ros1<Compression::kBz2>},
    {"g.db3", RosEncoding::kCdr, write_sqlite_bag},
};

class BagFormats : public ::testing::TestWithParam<WrittenFormat> {};

TEST_P(BagFormats, GiveBackTopicsTimesAndBytes) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / GetParam().name;
  const std::vector<WrittenMessage> messages = some_messages(GetParam().encoding);
  GetParam().write(path, messages);
  EXPECT_TRUE(is_bag_file(path));
  Bag bag(path);
  const BagContent& content = bag.content();
  EXPECT_THAT(content.faults, IsEmpty());
  ASSERT_EQ(content.topics.size(), 3U);
  EXPECT_EQ(content.topics[0].name, "/left/image_raw");
  EXPECT_EQ(content.topics[0].type, "sensor_msgs/Image");
  EXPECT_EQ(content.topics[2].type, "sensor_msgs/Imu");
  EXPECT_EQ(content.topics[2].num_messages, 5U);
  ASSERT_EQ(content.messages.size(), 10U) << "those of the IMU are counted only";
  for (std::size_t i : {9U, 0U, 4U, 5U}) {  // In any order.
    const BagMessage& message = content.messages[i];
    EXPECT_EQ(message.topic, i % 2);
    EXPECT_EQ(message.timestamp_ns, 10 * kSecond + static_cast<std::int64_t>(i / 2) * kSecond / 20);
    EXPECT_EQ(bag.read(message), messages[i / 2 * 3 + i % 2].bytes) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Ros, BagFormats, ::testing::ValuesIn(kFormats), [](const auto& info) {
  return std::string(1, info.param.name[0]);
});

TEST(Bag, TakesTheTimeOfRecordingWhereAHeaderHasNone) {
  const TemporaryFolder folder;
  const auto bytes =
      write_message(RosEncoding::kCdr, 0, RosImage{"f", 1, 1, "mono8", false, 1, "a"});
  write_bytes(folder / "a.mcap", make_mcap({{"/a", "sensor_msgs/Image", 3 * kSecond, bytes}}));
  const Bag bag(folder / "a.mcap");
  EXPECT_EQ(bag.content().messages.at(0).timestamp_ns, 3 * kSecond);
  EXPECT_EQ(bag.content().num_unstamped, 1U);
}

/// The first and the second half of the messages as two files and metadata.yaml.
void write_split_bag(const TemporaryFolder& folder) {
  const std::vector<WrittenMessage> messages = some_messages(RosEncoding::kCdr);
  const auto middle = messages.begin() + 6;
  write_sqlite_bag(folder / "walk_0.db3", {messages.begin(), middle});
  write_sqlite_bag(folder / "walk_1.db3", {middle, messages.end()});
  folder.write("metadata.yaml",
               "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
               "  relative_file_paths:\n    - walk_0.db3\n    - walk/walk_1.db3\n"
               "  compression_format: \"\"\n  compression_mode: \"\"\n");
}

TEST(Bag, OfSeveralFilesIsOne) {
  const TemporaryFolder folder;
  write_split_bag(folder);
  EXPECT_TRUE(is_bag_folder(folder.path()));
  Bag bag(folder.path());
  EXPECT_EQ(bag.files().size(), 2U);
  EXPECT_EQ(bag.content().topics.size(), 3U);
  ASSERT_EQ(bag.content().messages.size(), 10U);
  EXPECT_EQ(bag.content().messages[9].timestamp_ns, 10 * kSecond + 4 * kSecond / 20);
  EXPECT_EQ(bag.read(bag.content().messages[9]).back(), 'e');
}

TEST(Bag, DoesWithoutMetadataAndWithoutAMissingFile) {
  const TemporaryFolder folder;
  write_split_bag(folder);
  std::filesystem::remove(folder / "walk_0.db3");
  const Bag one(folder.path());
  EXPECT_EQ(one.content().messages.size(), 6U);
  EXPECT_THAT(one.content().faults, ElementsAre(HasSubstr("walk_0.db3: missing, left out")));
  std::filesystem::remove(folder / "metadata.yaml");
  EXPECT_EQ(Bag(folder.path()).content().messages.size(), 6U);
}

TEST(Bag, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  folder.write("text.bag", "no bag");
  EXPECT_THAT(input_error_of([&] { Bag(folder / "text.bag"); }), HasSubstr("text.bag: is no bag"));
  folder.write("old.bag", "#ROSBAG V1.2\n");
  EXPECT_THAT(input_error_of([&] { Bag(folder / "old.bag"); }), HasSubstr("format 2.0"));
  EXPECT_THAT(input_error_of([&] { Bag(folder.path()); }), HasSubstr("holds 2 bags, expected one"));
  folder.write("empty.db3", std::string("SQLite format 3\0", 16));
  EXPECT_THAT(input_error_of([&] { Bag(folder / "empty.db3"); }), HasSubstr("topics and messages"));
}

TEST(Bag, SaysHowToDecompressOneThatIsCompressedAsAWhole) {
  const TemporaryFolder folder;
  folder.write("metadata.yaml",
               "rosbag2_bagfile_information:\n  relative_file_paths: [walk_0.db3.zstd]\n"
               "  compression_mode: FILE\n");
  EXPECT_THAT(input_error_of([&] { Bag(folder.path()); }), HasSubstr("zstd -d walk_0.db3.zstd"));
  folder.write("metadata.yaml",
               "rosbag2_bagfile_information:\n  relative_file_paths: [walk_0.db3]\n"
               "  compression_mode: MESSAGE\n");
  EXPECT_THAT(input_error_of([&] { Bag(folder.path()); }), HasSubstr("compressed one by one"));
}

}  // namespace
}  // namespace waymark

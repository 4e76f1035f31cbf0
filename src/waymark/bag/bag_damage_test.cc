// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Bags that are cut off, changed or made to mislead: what is whole is read, and no byte of them
// does harm.
#include <gmock/gmock.h>

#include "waymark/bag/bag.h"
#include "waymark/bag/testing/bag_writer.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::little;
using testing::make_mcap;
using testing::make_ros1_bag;
using testing::TemporaryFolder;
using testing::write_bytes;
using testing::write_message;
using testing::WrittenMessage;

std::vector<WrittenMessage> images(RosEncoding encoding, int count = 12) {
  std::vector<WrittenMessage> messages;
  for (int i = 0; i < count; ++i) {
    const std::string pixels(40, static_cast<char>('a' + i));
    const std::int64_t time_ns = 1'000'000'000 + i;
    messages.push_back(
        {"/camera/image_raw",
         "sensor_msgs/Image",
         time_ns,
         write_message(encoding, time_ns, RosImage{"f", 5, 8, "mono8", false, 8, pixels})});
  }
  return messages;
}

std::string bytes_of(const std::string& name, Compression compression) {
  if (name == "a.bag") return make_ros1_bag(images(RosEncoding::kRos1), compression);
  if (name == "a.mcap") return make_mcap(images(RosEncoding::kCdr), compression);
  const TemporaryFolder folder;
  testing::write_sqlite_bag(folder / name, images(RosEncoding::kCdr));
  std::ifstream stream(folder / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Messages that can be read, each of which has to be one that was written.
std::size_t num_read(Bag& bag, bool may_be_wrong = false) {
  std::size_t count = 0;
  for (const BagMessage& message : bag.content().messages) {
    const auto encoding = bag.content().topics[message.topic].encoding;
    try {
      const std::string bytes = bag.read(message);
      const auto image = parse_ros_image(bytes, encoding);
      const bool is_right = image && image->data.size() == 40;
      EXPECT_TRUE(may_be_wrong || is_right) << message.place.offset;
      ++count;
    } catch (const InputError&) {
      EXPECT_TRUE(may_be_wrong);
    }
  }
  return count;
}

struct Case {
  const char* name;
  Compression compression;
};

class DamagedBags : public ::testing::TestWithParam<Case> {};

TEST_P(DamagedBags, CutOffGiveWhatIsWholeAndSaySo) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / GetParam().name;
  const std::string whole = bytes_of(GetParam().name, GetParam().compression);
  std::size_t most = 0;
  for (std::size_t size = 64; size + 60 < whole.size(); size += 97) {
    write_bytes(path, whole.substr(0, size));
    Bag bag(path);
    const std::size_t count = num_read(bag);
    EXPECT_GE(count, most) << "at " << size << " bytes";
    EXPECT_LT(count, 13U);
    most = std::max(most, count);
    if (count == 12) continue;
    EXPECT_THAT(bag.content().faults, ElementsAre(HasSubstr("cut off"))) << size;
  }
  EXPECT_GE(most, 8U) << "all but the last chunk";
}

TEST_P(DamagedBags, WithAnyByteChangedDoNoHarm) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / GetParam().name;
  const std::string whole = bytes_of(GetParam().name, GetParam().compression);
  Rng rng(1, 2);
  for (int i = 0; i < 100; ++i) {
    std::string bytes = whole;
    const std::size_t at =
        static_cast<std::size_t>(rng.uniform() * static_cast<double>(bytes.size()));
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << i % 8));
    write_bytes(path, bytes);
    try {
      Bag bag(path);
      num_read(bag, /*may_be_wrong=*/true);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Ros,
                         DamagedBags,
                         ::testing::Values(Case{"a.bag", Compression::kNone},
                                           Case{"a.bag", Compression::kLz4},
                                           Case{"a.bag", Compression::kBz2},
                                           Case{"a.mcap", Compression::kNone},
                                           Case{"a.mcap", Compression::kLz4},
                                           Case{"a.mcap", Compression::kZstd}));

TEST(DamagedBag, OfSqliteGivesWhatCanBeRead) {
  const TemporaryFolder folder;
  const std::string whole = bytes_of("a.db3", Compression::kNone);
  Rng rng(3, 4);
  for (int i = 0; i < 100; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 4; ++k) {
      const auto at = static_cast<std::size_t>(rng.uniform() * static_cast<double>(bytes.size()));
      bytes[at] = static_cast<char>(rng.below(256));
    }
    if (i % 4 == 0) bytes.resize(bytes.size() * 3 / 4);
    write_bytes(folder / "a.db3", bytes);
    try {
      Bag bag(folder / "a.db3");
      num_read(bag, /*may_be_wrong=*/true);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
    }
  }
}

TEST(DamagedBag, OfSqliteWhosePagesGoInACircleEnds) {
  const TemporaryFolder folder;
  testing::write_sqlite_bag(folder / "a.db3", images(RosEncoding::kCdr, 120));
  std::ifstream stream(folder / "a.db3", std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  // The root of the messages is the third page: as its last child it gets its first one.
  const std::size_t root = 2 * 4096;
  ASSERT_EQ(bytes[root], 5) << "an interior page";
  const auto first_cell =
      static_cast<std::size_t>(static_cast<unsigned char>(bytes[root + 12]) * 256 +
                               static_cast<unsigned char>(bytes[root + 13]));
  bytes.replace(root + 8, 4, bytes.substr(root + first_cell, 4));
  write_bytes(folder / "a.db3", bytes);
  const Bag bag(folder / "a.db3");
  EXPECT_LT(bag.content().messages.size(), 120U);
  EXPECT_THAT(bag.content().faults, ElementsAre(HasSubstr("cut off or damaged")));
}

TEST(DamagedBag, LeavesOutAChunkWhoseChecksumIsWrong) {
  const TemporaryFolder folder;
  std::string bytes = make_mcap(images(RosEncoding::kCdr), Compression::kLz4);
  // The checksum of the second chunk of three.
  const std::size_t second = bytes.find("lz4", bytes.find("lz4") + 3);
  bytes[second - 5] = static_cast<char>(bytes[second - 5] ^ 1);
  write_bytes(folder / "a.mcap", bytes);
  Bag bag(folder / "a.mcap");
  EXPECT_EQ(num_read(bag), 8U);
  EXPECT_THAT(bag.content().faults, ElementsAre(HasSubstr("1 damaged chunk")));
}

/// Kilobytes of a bag can hold gigabytes.
TEST(DamagedBag, DecompressesNoMoreThanItsSizeAccountsFor) {
  const TemporaryFolder folder;
  const std::string empty(kMaxChunkBytes / 8, '\0');
  const std::string packed = testing::compress(Compression::kZstd, empty);
  std::string bytes("\x89MCAP0\r\n", 8);
  for (int i = 0; i < 5; ++i) {
    bytes += testing::mcap_record(6,
                                  std::string(16, '\0') + little(std::uint64_t{empty.size()}) +
                                      little(std::uint32_t{0}) + testing::counted("zstd") +
                                      little(std::uint64_t{packed.size()}) + packed);
  }
  bytes += testing::mcap_record(0x0F, little(std::uint32_t{0}));
  write_bytes(folder / "a.mcap", bytes);
  const Bag bag(folder / "a.mcap");
  EXPECT_THAT(bag.content().faults, ElementsAre(HasSubstr("1 damaged chunks")));
}

TEST(DamagedBag, WithMoreTopicsThanMemoryIsRefused) {
  BagContent content;
  const std::string name(1000, 'n');
  EXPECT_THAT(testing::input_error_of([&] {
                for (int i = 0; i < 100'000; ++i) {
                  const auto index = static_cast<std::uint32_t>(i);
                  ASSERT_EQ(content.topic_of(name + std::to_string(i), "t", RosEncoding::kCdr),
                            index);
                }
              }),
              HasSubstr("is one of too many"));
  EXPECT_EQ(content.topic_of(name + "0", "t", RosEncoding::kCdr), 0U) << "is known";
  EXPECT_LT(content.topics.size(), 100'000U);
}

TEST(Decompression, ChecksWhatIsStated) {
  const std::string text(100'000, 'x');
  for (const Compression kind : {Compression::kLz4, Compression::kZstd, Compression::kBz2}) {
    const std::string packed = testing::compress(kind, text);
    EXPECT_EQ(decompress(kind, packed, text.size()), text);
    EXPECT_FALSE(decompress(kind, packed, text.size() - 1));
    EXPECT_FALSE(decompress(kind, packed, text.size() + 1));
    EXPECT_FALSE(decompress(kind, packed.substr(0, packed.size() / 2), text.size()));
    EXPECT_FALSE(decompress(kind, packed, kMaxChunkBytes + 1));
    EXPECT_FALSE(decompress(kind, "", text.size()));
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/msgpack.h"

#include <gtest/gtest.h>

#include <msgpack.hpp>
#include <sstream>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

using Kind = MsgpackValue::Kind;

MsgpackValue read_whole(const std::string& bytes) {
  MsgpackValue value;
  std::size_t at = 0;
  EXPECT_TRUE(read_msgpack(bytes, at, value));
  EXPECT_EQ(at, bytes.size());
  return value;
}

/// What another implementation packs.
template <class T>
std::string packed_by_other(const T& value) {
  std::stringstream stream;
  msgpack::pack(stream, value);
  return stream.str();
}

TEST(Msgpack, WritesAndReadsIntegersOfEverySizeLikeTheOther) {
  for (int bits = 0; bits < 64; ++bits) {
    for (int step = -1; step <= 1; ++step) {
      const std::uint64_t value = (std::uint64_t{1} << bits) + static_cast<std::uint64_t>(step);
      std::string bytes;
      pack_unsigned(bytes, value);
      EXPECT_EQ(bytes, packed_by_other(value)) << value;
      EXPECT_EQ(read_whole(bytes).kind, Kind::kUnsigned);
      EXPECT_EQ(read_whole(bytes).whole, value);

      const auto negative = -static_cast<std::int64_t>(value >> 1) - 1;
      bytes.clear();
      pack_signed(bytes, negative);
      EXPECT_EQ(bytes, packed_by_other(negative)) << negative;
      EXPECT_EQ(read_whole(bytes).kind, Kind::kNegative);
      EXPECT_EQ(read_whole(bytes).negative, negative);
    }
  }
}

TEST(Msgpack, WritesAndReadsTextAndBytesOfEverySizeLikeTheOther) {
  for (const std::size_t size : {0u, 1u, 31u, 32u, 255u, 256u, 65535u, 65536u, 100000u}) {
    const std::string text(size, 'x');
    std::string bytes;
    pack_text(bytes, text);
    EXPECT_EQ(bytes, packed_by_other(text));
    EXPECT_EQ(read_whole(bytes).bytes, text);
    bytes.clear();
    pack_bytes(bytes, text);
    EXPECT_EQ(bytes, packed_by_other(std::vector<char>(text.begin(), text.end())));
    EXPECT_EQ(read_whole(bytes).kind, Kind::kBytes);
    EXPECT_EQ(read_whole(bytes).bytes, text);
    bytes.clear();
    pack_array_size(bytes, size);
    for (std::size_t i = 0; i < size; ++i) pack_nil(bytes);
    EXPECT_EQ(bytes, packed_by_other(std::vector<msgpack::type::nil_t>(size)));
    std::size_t at = 0;
    EXPECT_TRUE(skip_msgpack(bytes, at));
    EXPECT_EQ(at, bytes.size());
  }
}

TEST(Msgpack, KeepsTheSignOfZeroAndTheFormatOfWholeNumbers) {
  for (const double value : {0.0, -0.0, 1.0, -2.5e300}) {
    std::string bytes;
    pack_number(bytes, value);
    EXPECT_EQ(bytes.size(), 9u);
    EXPECT_EQ(read_whole(bytes).number, value);
    EXPECT_EQ(std::signbit(read_whole(bytes).number), std::signbit(value));
  }
  EXPECT_EQ(read_whole(packed_by_other(0.5f)).number, 0.5);
}

/// Any bytes at all: what is read agrees with the other implementation about where a value ends.
TEST(Msgpack, EndsWhereTheOtherEnds) {
  int num_whole = 0;
  for (std::uint64_t round = 0; round < 20000; ++round) {
    Rng rng(11, round);
    std::string bytes(1 + rng.below(24), '\0');
    for (char& byte : bytes) byte = static_cast<char>(rng.below(256));
    if (rng.below(2)) bytes[0] = static_cast<char>(0x80 + rng.below(0x60));
    std::size_t end = 0;
    bool is_whole = true;
    try {
      msgpack::unpack(bytes.data(), bytes.size(), end, nullptr, nullptr, {64, 64, 64, 64, 64, 30});
    } catch (const msgpack::unpack_error&) {
      is_whole = false;
    }
    std::size_t at = 0;
    ASSERT_EQ(skip_msgpack(bytes, at), is_whole) << round;
    if (is_whole) {
      ASSERT_EQ(at, end) << round;
    }
    num_whole += is_whole;
  }
  EXPECT_GT(num_whole, 5000);
}

}  // namespace
}  // namespace waymark

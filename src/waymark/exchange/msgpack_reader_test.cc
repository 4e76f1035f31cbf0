// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/msgpack_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using Json = nlohmann::json;

std::string pack(const Json& json) {
  const std::vector<std::uint8_t> bytes = Json::to_msgpack(json);
  return {bytes.begin(), bytes.end()};
}

std::string error_of(const std::function<void()>& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(MsgpackReader, ReadsEverySizeOfIntegers) {
  for (const std::int64_t value :
       {0ll,           1ll,           127ll,          128ll,        255ll,           256ll,
        65535ll,       65536ll,       4294967295ll,   4294967296ll, INT64_MAX + 0ll, -1ll,
        -32ll,         -33ll,         -128ll,         -129ll,       -32768ll,        -32769ll,
        -2147483648ll, -2147483649ll, INT64_MIN + 0ll}) {
    const std::string bytes = pack(value);
    MsgpackReader reader(bytes, "file");
    EXPECT_EQ(reader.read_integer(INT64_MIN, INT64_MAX), value);
    reader.expect_end();
    MsgpackReader skipping(bytes, "file");
    skipping.skip();
    skipping.expect_end();
  }
  const std::string largest = pack(UINT64_MAX);
  EXPECT_THAT(error_of([&] { MsgpackReader(largest, "file").read_integer(0, INT64_MAX); }),
              ::testing::HasSubstr("18446744073709551615"));
}

TEST(MsgpackReader, ReadsNumbersAndStrings) {
  const Json array = {0.1,
                      0.5f,
                      -7,
                      40000,
                      "",
                      std::string(31, 'a'),
                      std::string(300, 'b'),
                      std::string(70000, 'c')};
  const std::string bytes = pack(array);
  MsgpackReader reader(bytes, "file");
  reader.read_array_of(array.size(), [&](std::size_t i) {
    if (i < 4) {
      EXPECT_EQ(reader.read_number(1e5), array[i].get<double>());
    } else {
      EXPECT_EQ(reader.read_string(), array[i].get<std::string>());
    }
  });
  reader.expect_end();
}

TEST(MsgpackReader, PassesOverAnything) {
  Json json = {{"deep", nullptr}, {"list", {1, 2.5, true, {{"a", "b"}}}}};
  json["bytes"] = Json::binary(std::vector<std::uint8_t>(300, 1));
  json["typed"] = Json::binary({1, 2, 3, 4}, 5);
  json["odd"] = Json::binary({1, 2, 3}, 5);
  json["long"] = std::vector<int>(70000, 3);
  for (int i = 0; i < 20; ++i) json["map"][std::to_string(i)] = i;
  const std::string bytes = pack({{"all", json}, {"x", 1}});
  MsgpackReader reader(bytes, "file");
  std::int64_t x = 0;
  const MsgpackReader::Field field{"x", [&] { x = reader.read_integer(0, 9); }};
  reader.read_record({&field, 1});
  reader.expect_end();
  EXPECT_EQ(x, 1);
}

TEST(MsgpackReader, DoesNotRecurse) {
  const std::string bytes = std::string(1'000'000, '\x91') + '\x00';
  MsgpackReader reader(bytes, "file");
  reader.skip();
  reader.expect_end();
}

TEST(MsgpackReader, NamesTheWayToTheValue) {
  const std::string bytes = pack({{"outer", {{"list", {1, 2, "three"}}}}});
  MsgpackReader reader(bytes, "file");
  const std::string error = error_of([&] {
    reader.read_map([&](std::string_view) {
      reader.read_map([&](std::string_view) {
        reader.read_array_of(3, [&](std::size_t) { reader.read_integer(0, 9); });
      });
    });
  });
  EXPECT_EQ(error, "file: outer.list[2]: is a string, expected an integer");
}

TEST(MsgpackReader, BelievesNoLengthThatTheFileCannotHold) {
  for (const std::string& bytes : {std::string("\xdd\xff\xff\xff\xff\x01", 6),  // An array.
                                   std::string("\xdf\xff\xff\xff\xff\x01", 6),  // A map.
                                   std::string("\xdb\xff\xff\xff\xff\x01", 6),  // A string.
                                   std::string("\xc6\xff\xff\xff\xff\x01", 6),  // Bytes.
                                   std::string("\xc9\xff\xff\xff\xff\x01", 6),  // An extension.
                                   std::string("\xdc\x00\x05\x01\x01", 5),
                                   std::string("\xcb\x00", 2),
                                   std::string()}) {
    EXPECT_THAT(error_of([&] { MsgpackReader(bytes, "file").skip(); }),
                ::testing::HasSubstr("truncated"));
  }
}

TEST(MsgpackReader, WantsEachKeyOnceAndThoseItNeeds) {
  const auto read = [](const std::string& bytes) {
    MsgpackReader reader(bytes, "file");
    const MsgpackReader::Field field{"x", [&] { reader.skip(); }};
    reader.read_record({&field, 1});
  };
  EXPECT_EQ(error_of([&] { read("\x82\xa1x\x01\xa1x\x02"); }),
            "file: x: is there twice, expected once");
  EXPECT_EQ(error_of([&] { read("\x81\xa1y\x01"); }), "file: has no x, which is needed");
  EXPECT_THAT(error_of([&] { read("\x81\xa1x\xc1"); }), ::testing::HasSubstr("0xc1"));
}

}  // namespace
}  // namespace waymark

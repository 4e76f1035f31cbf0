// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/time_column.h"

#include <gmock/gmock.h>

#include <vector>

#include "waymark/base/testing/errors.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

TEST(TimeUnit, FollowsFromSizeAndDistance) {
  const auto unit_of = [](const std::vector<std::string_view>& times) {
    return time_unit_ns(times);
  };
  constexpr std::int64_t kSecond = 1'000'000'000, kMilli = 1'000'000, kMicro = 1000;
  EXPECT_EQ(unit_of({}), kSecond);
  EXPECT_EQ(unit_of({"0", "0.05", "0.1"}), kSecond);
  EXPECT_EQ(unit_of({"1403636579.0", "1403636579.05"}), kSecond);
  EXPECT_EQ(unit_of({"0", "86400", "172800"}), kSecond);  // A picture a day.
  EXPECT_EQ(unit_of({"1403636579000000000.000000", "1403636579025000192.000000"}), 1);
  EXPECT_EQ(unit_of({"0", "50000000", "100000000"}), 1);
  EXPECT_EQ(unit_of({"2000000000000", "2000050000000"}), 1);  // 33 minutes after the start.
  EXPECT_EQ(unit_of({"1403636579000", "1403636579050"}), kMilli);
  EXPECT_EQ(unit_of({"1403636579000000", "1403636579050000"}), kMicro);
  EXPECT_EQ(unit_of({"x", "1403636579000000000"}), 1);
}

TEST(TimeColumn, IsReadInItsUnit) {
  const std::string_view text = "0 a\n50000000.5 b\n1e10 c\nx d\n-1 e\n";
  const TimeColumn column(text, ' ');
  RowReader rows(text, "f.txt", ' ');
  std::vector<std::int64_t> times_ns;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(rows.next());
    times_ns.push_back(column.read(rows));
  }
  EXPECT_THAT(times_ns, ElementsAre(0, 50'000'001, 10'000'000'000));
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(testing::input_error_of([&] { column.read(rows); }),
              HasSubstr("f.txt:4: field 1 is 'x', expected a time"));
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(testing::input_error_of([&] { column.read(rows); }), HasSubstr("field 1 is '-1'"));
}

TEST(ParseTime, KeepsEveryDigit) {
  EXPECT_THAT(parse_time("1403636579025000192.000000", 1), Optional(1403636579025000192));
  EXPECT_THAT(parse_time("1.403636579025000192e+18", 1), Optional(1403636579025000192));
  EXPECT_THAT(parse_time("1403636579025.5", 1'000'000), Optional(1403636579025500000));
  EXPECT_THAT(parse_time("1.5", 1'000'000'000), Optional(1'500'000'000));
  for (const char* text : {"", "e", "1e", "1ex", "1e5000", "1e18", "nan"}) {
    EXPECT_EQ(parse_time(text, 1'000'000'000), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/text.h"

#include <gmock/gmock.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

TEST(ParseSeconds, KeepsEveryDigit) {
  EXPECT_THAT(parse_seconds("1305031229.528748"), Optional(1305031229528748000));
  EXPECT_THAT(parse_seconds("1403636584.763555584"), Optional(1403636584763555584));
  EXPECT_THAT(parse_seconds("1.037360e-01"), Optional(103736000));
  EXPECT_THAT(parse_seconds("0.000000e+00"), Optional(0));
  EXPECT_THAT(parse_seconds("+12"), Optional(12000000000));
  EXPECT_THAT(parse_seconds(".5"), Optional(500000000));
  EXPECT_THAT(parse_seconds("5."), Optional(5000000000));
  EXPECT_THAT(parse_seconds("-1.5E1"), Optional(-15000000000));
}

TEST(ParseSeconds, RoundsHalfAwayFromZeroBelowNanoseconds) {
  EXPECT_THAT(parse_seconds("0.0000000014"), Optional(1));
  EXPECT_THAT(parse_seconds("0.0000000015"), Optional(2));
  EXPECT_THAT(parse_seconds("-0.0000000015"), Optional(-2));
  EXPECT_THAT(parse_seconds("5e-10"), Optional(1));
  EXPECT_THAT(parse_seconds("4.9e-10"), Optional(0));
  EXPECT_THAT(parse_seconds("9e-11"), Optional(0));
}

TEST(ParseSeconds, RefusesWhatIsNoTime) {
  for (const char* text : {"",
                           "-",
                           ".",
                           "e5",
                           "1e",
                           "1e5x",
                           "1.2.3",
                           "nan",
                           "inf",
                           "0x10",
                           "1 ",
                           "1,5",
                           "1e9999999999",
                           "1403636579763555584",
                           "9223372037",
                           "1e400",
                           "--1"}) {
    EXPECT_EQ(parse_seconds(text), std::nullopt) << text;
  }
  EXPECT_EQ(parse_seconds(std::string(10000, '9')), std::nullopt);
  EXPECT_THAT(parse_seconds("9223372036.854775807"), Optional(INT64_MAX));
}

TEST(FormatSeconds, IsTheInverseOfParsing) {
  EXPECT_EQ(format_seconds(0), "0.000000000");
  EXPECT_EQ(format_seconds(1403636584763555584), "1403636584.763555584");
  EXPECT_EQ(format_seconds(-1), "-0.000000001");
  EXPECT_EQ(format_seconds(INT64_MIN), "-9223372036.854775808");
  Rng rng(1, 2);
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t time_ns = static_cast<std::int64_t>(rng.next() >> 1) * (i % 2 ? 1 : -1);
    EXPECT_THAT(parse_seconds(format_seconds(time_ns)), Optional(time_ns));
  }
}

TEST(FormatDecimals, GivesZeroNoSign) {
  EXPECT_EQ(format_decimals(-1.5, 3), "-1.500");
  EXPECT_EQ(format_decimals(-0.0006, 3), "-0.001");
  EXPECT_EQ(format_decimals(-0.0004, 3), "0.000");
  EXPECT_EQ(format_decimals(-0.0, 9), "0.000000000");
  EXPECT_EQ(format_decimals(-0.4, 0), "0");
  EXPECT_FALSE(std::signbit(unsigned_zero(-0.0)));
  EXPECT_EQ(unsigned_zero(-1e-300), -1e-300);
  EXPECT_EQ(count_of(1, "loop"), "1 loop");
  EXPECT_EQ(count_of(0, "loop"), "0 loops");
  EXPECT_EQ(count_of(12, "match", "matches"), "12 matches");
}

TEST(ParseNumber, WantsTheWholeTextAndFiniteValues) {
  EXPECT_THAT(parse_number("-1.5e-3"), Optional(-1.5e-3));
  EXPECT_THAT(parse_number("+2"), Optional(2.0));
  for (const char* text : {"", "1x", "nan", "inf", "-inf", "1e999", "1,5", " 1", "+-1", "0x10"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
}

TEST(RowReader, SkipsCommentsAndCountsLines) {
  RowReader rows("\xEF\xBB\xBF# comment\r\n\n 1 \t 2\r\n  # more\nx", "f.txt", ' ');
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.fields(), ElementsAre("1", "2"));
  EXPECT_EQ(rows.where(), "f.txt:3");
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.fields(), ElementsAre("x"));
  EXPECT_EQ(rows.where(), "f.txt:5");
  EXPECT_FALSE(rows.next());
}

TEST(RowReader, KeepsEmptyFieldsBetweenCommas) {
  RowReader rows("1, ,3,", "f.csv", ',');
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.fields(), ElementsAre("1", "", "3", ""));
}

TEST(RowReader, SaysWhereAndWhatWasExpected) {
  RowReader rows("\n1.5 abc ../x\n", "f.txt", ' ');
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(testing::input_error_of([&] { rows.number(1); }),
            "f.txt:2: field 2 is 'abc', expected a finite number");
  EXPECT_THAT(testing::input_error_of([&] { rows.nanoseconds(0); }),
              HasSubstr("f.txt:2: field 1 is '1.5', expected a time in whole"));
  EXPECT_THAT(testing::input_error_of([&] { rows.relative_path(2); }),
              HasSubstr("expected a file name below"));
  EXPECT_EQ(testing::input_error_of([&] { rows.expect_exactly(2, "2: a b"); }),
            "f.txt:2: 3 fields, expected 2: a b");
}

TEST(RowReader, RefusesNegativeTimes) {
  RowReader rows("-1", "f.txt", ' ');
  ASSERT_TRUE(rows.next());
  EXPECT_THROW(rows.nanoseconds(0), InputError);
}

TEST(RowReader, AcceptsNoPathOutsideTheFolder) {
  for (const char* path : {"/etc/passwd",
                           "..",
                           "a/../../b",
                           "a\x01"
                           "b"}) {
    RowReader rows(path, "f.txt", ' ');
    ASSERT_TRUE(rows.next());
    EXPECT_THROW(rows.relative_path(0), InputError) << path;
  }
  RowReader rows("rgb/1.png", "f.txt", ' ');
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.relative_path(0), "rgb/1.png");
}

TEST(QuoteForMessage, StaysOneShortLine) {
  EXPECT_EQ(quote_for_message("a\nb\x7F"), "'a?b?'");
  EXPECT_LT(quote_for_message(std::string(1000, 'x')).size(), 50u);
}

TEST(Printable, ShowsControlCharacters) {
  EXPECT_EQ(printable("plain \xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80 text"),
            "plain \xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80 text");
  EXPECT_EQ(printable("\x1B]0;title\a\r\n\t\x7F"), "\\x1b]0;title\\x07\\x0d\\x0a\\x09\\x7f");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\xc2\\x9b31m");  // CSI as one character.
  EXPECT_EQ(printable("\x9B\xE4\xE2\x82"), "\\x9b\\xe4\\xe2\\x82");
  EXPECT_EQ(printable("a\nb\r\n", true), "a\nb\\x0d\n");
  EXPECT_EQ(printable(std::string("\0", 1)), "\\x00");
}

TEST(ReadTextFile, NamesWhatIsMissing) {
  const testing::TemporaryFolder folder;
  EXPECT_THAT(testing::input_error_of([&] { read_text_file(folder / "no.txt", "a list"); }),
              HasSubstr("no.txt: missing, expected a list"));
  EXPECT_THAT(testing::input_error_of([&] { read_text_file(folder.path(), "a list"); }),
              HasSubstr("no regular file"));
  folder.write("big.txt", std::string(100, 'x'));
  EXPECT_THAT(testing::input_error_of([&] { read_text_file(folder / "big.txt", "a list", 99); }),
              HasSubstr("larger than"));
  EXPECT_EQ(read_text_file(folder / "big.txt", "a list", 100).size(), 100u);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/config_value.h"

#include <gmock/gmock.h>

#include <functional>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

ConfigNode value(const std::string& yaml) {
  return *parse_config({"a.yaml", "k: " + yaml + "\n"}).find("k");
}

std::string refusal_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ConfigValue, ReadsEachType) {
  EXPECT_TRUE(config_bool(value("true"), "k"));
  EXPECT_FALSE(config_bool(value("false"), "k"));
  EXPECT_EQ(config_int(value("-12"), "k"), -12);
  EXPECT_EQ(config_int(value("+12"), "k"), 12);
  EXPECT_EQ(config_double(value("1.5e-3"), "k"), 1.5e-3);
  EXPECT_EQ(config_double(value("2"), "k"), 2.0);
  EXPECT_EQ(config_string(value("a b"), "k"), "a b");
  EXPECT_EQ(config_string(value("'12'"), "k"), "12");
  EXPECT_THAT(config_doubles(value("[1, -2.5, 1e2]"), "k"), ElementsAre(1.0, -2.5, 100.0));
  EXPECT_THAT(config_doubles(value("[]"), "k"), ElementsAre());
}

TEST(ConfigValue, RefusesOtherTypes) {
  for (const char* yaml : {"yes", "1", "True", "[true]", "", "{}"}) {
    EXPECT_THAT(refusal_of([&] { config_bool(value(yaml), "k"); }),
                EndsWith("expected true or false"));
  }
  for (const char* yaml :
       {"1.0", "1e3", "x", "0x10", "1 2", "''", "", "[1]", "99999999999", "+-1", "true"}) {
    EXPECT_THAT(refusal_of([&] { config_int(value(yaml), "k"); }), EndsWith("expected an integer"))
        << yaml;
  }
  for (const char* yaml :
       {"nan", ".nan", "inf", ".inf", "-inf", "1e999", "1,5", "1.5m", "", "[1.0]", "{a: 1}"}) {
    EXPECT_THAT(refusal_of([&] { config_double(value(yaml), "k"); }), EndsWith("expected a number"))
        << yaml;
  }
  for (const char* yaml : {"", "[a]", "{a: b}"}) {
    EXPECT_THAT(refusal_of([&] { config_string(value(yaml), "k"); }), EndsWith("expected a text"));
  }
  for (const char* yaml : {"1", "[1, x]", "[1, [2]]", "[nan]"}) {
    EXPECT_THAT(refusal_of([&] { config_doubles(value(yaml), "k"); }), HasSubstr("expected a"))
        << yaml;
  }
}

TEST(ConfigValue, NamesPlaceValueAndRange) {
  EXPECT_EQ(refusal_of([&] { config_int(value("7"), "t.m", {.low = 10, .high = 1000}); }),
            "a.yaml:1: t.m is 7, expected an integer from 10 to 1000");
  EXPECT_EQ(refusal_of([&] { config_double(value("-0.5"), "t.m", {.low = 0}); }),
            "a.yaml:1: t.m is -0.5, expected a number of at least 0");
  EXPECT_EQ(refusal_of([&] { config_doubles(value("[1, 5]"), "t.m", {.high = 2.5}); }),
            "a.yaml:1: t.m[1] is 5, expected a number of at most 2.5");
  EXPECT_EQ(refusal_of([&] { config_int(value("{x: 1}"), "t.m"); }),
            "a.yaml:1: t.m is a section, expected an integer");
  EXPECT_EQ(config_int(value("10"), "t.m", {.low = 10, .high = 10}), 10);
}

TEST(ConfigValue, MessagesStayOnOneShortLine) {
  const std::string message =
      refusal_of([&] { config_int(value("\"" + std::string(1000, 'x') + "\\n\""), "k"); });
  EXPECT_LT(message.size(), 120u);
  EXPECT_EQ(refusal_of([&] { config_int(value("\"a\\nb\""), "k"); }),
            "a.yaml:1: k is a b, expected an integer");
}

TEST(ConfigValue, UnknownKeysNameTheNearest) {
  const std::vector<std::string> known = {"seed",
                                          "tracking",
                                          "tracking.min_num_matches",
                                          "tracking.ratio",
                                          "features",
                                          "features.count"};
  const auto message = [&](const char* key) {
    return refusal_of([&] { fail_unknown_key(value("1"), key, known); });
  };
  EXPECT_EQ(
      message("tracking.min_num_match"),
      "a.yaml:1: unknown key 'tracking.min_num_match', did you mean 'tracking.min_num_matches'?");
  EXPECT_THAT(message("trakcing"), EndsWith("did you mean 'tracking'?"));
  EXPECT_THAT(message("count"), EndsWith("did you mean 'features.count'?"));
  EXPECT_THAT(message("tracking.count"), EndsWith("did you mean 'features.count'?"));
  EXPECT_THAT(message("tracking.something_else"),
              EndsWith("expected one of min_num_matches, ratio"));
  EXPECT_THAT(message("something_else"), EndsWith("expected one of seed, tracking, features"));
  EXPECT_LT(message(std::string(100000, 'x').c_str()).size(), 200u);
}

TEST(ConfigValue, EditDistance) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("abc", ""), 3);
  EXPECT_EQ(edit_distance("", "ab"), 2);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("abcd", "abdc"), 1);
  EXPECT_EQ(edit_distance("ca", "abc"), 3);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/config.h"

#include <gmock/gmock.h>

#include <fstream>
#include <functional>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using Kind = ConfigNode::Kind;

ConfigNode parse(const std::string& text) { return parse_config({"a.yaml", text}); }

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string parse_error(const std::string& text) {
  return error_of([&] { parse(text); });
}

TEST(Config, KeepsValuesAndLines) {
  const ConfigNode root =
      parse("# comment\na: 1\nb:\n  c: [1.5, x]\n  d:\n    - {e: 'two words'}\nf:\n");
  EXPECT_EQ(root.kind, Kind::kMap);
  EXPECT_THAT(root.keys, ElementsAre("a", "b", "f"));
  EXPECT_EQ(root.find("a")->scalar, "1");
  EXPECT_EQ(root.find("a")->where(), "a.yaml:2");
  const ConfigNode& b = *root.find("b");
  EXPECT_EQ(b.where(), "a.yaml:3");
  EXPECT_EQ(b.find("c")->kind, Kind::kList);
  EXPECT_EQ(b.find("c")->items[1].scalar, "x");
  EXPECT_EQ(b.find("d")->where(), "a.yaml:5");
  EXPECT_EQ(b.find("d")->items[0].find("e")->scalar, "two words");
  EXPECT_EQ(root.find("f")->kind, Kind::kNull);
  EXPECT_EQ(root.find("g"), nullptr);
}

TEST(Config, EmptyDocumentsAreEmptyMaps) {
  for (const char* text : {"", "\n", "# nothing\n", "---\n", "{}"}) {
    EXPECT_EQ(parse(text).kind, Kind::kMap) << text;
    EXPECT_TRUE(parse(text).items.empty()) << text;
  }
}

TEST(Config, LaterSourcesWin) {
  const ConfigNode merged = merge_configs({{"a.yaml", "s: {x: 1, y: 2}\nl: [1, 2, 3]\n"},
                                           {"b.yaml", "\ns: {y: 5, z: 6}\nl: [9]\nt: new\n"},
                                           {"c.yaml", "s:\n"},
                                           ConfigSource::from_assignment("s.z=7"),
                                           ConfigSource::from_assignment("u.v.w=[1, 2]")});
  EXPECT_THAT(merged.keys, ElementsAre("s", "l", "t", "u"));
  const ConfigNode& s = *merged.find("s");
  EXPECT_EQ(s.find("x")->where(), "a.yaml:1");
  EXPECT_EQ(s.find("y")->scalar, "5");
  EXPECT_EQ(s.find("y")->where(), "b.yaml:2");
  EXPECT_EQ(s.find("z")->scalar, "7");
  EXPECT_EQ(s.find("z")->where(), "--set s.z=7");
  EXPECT_EQ(merged.find("l")->items.size(), 1u);
  EXPECT_EQ(merged.find("u")->find("v")->find("w")->items.size(), 2u);
}

TEST(Config, MalformedAssignmentsAreRefused) {
  for (const char* text : {"a", "=1", ".a=1", "a.=1", "a..b=1", ""}) {
    EXPECT_THAT(error_of([&] { ConfigSource::from_assignment(text); }),
                AllOf(StartsWith(std::string("--set ") + text), HasSubstr("expected")))
        << text;
  }
  std::string deep = "a";
  for (int i = 0; i < 100; ++i) deep += ".a";
  EXPECT_THAT(error_of([&] { parse_config(ConfigSource::from_assignment(deep + "=1")); }),
              HasSubstr("nested deeper"));
}

TEST(Config, ErrorsNameTheLine) {
  EXPECT_THAT(parse_error("a: 1\nb: [1, 2\nc: 3\n"), StartsWith("a.yaml:"));
  EXPECT_THAT(parse_error("a: 1\n  b: 2\n"), AllOf(StartsWith("a.yaml:2: is not valid YAML")));
  EXPECT_THAT(parse_error("a: 1\nb: 2\na: 3\n"), "a.yaml:3: key 'a' appears twice in its section");
  EXPECT_THAT(parse_error("[1, 2]"), HasSubstr("a.yaml:1: is not a list of KEY: VALUE"));
  EXPECT_THAT(parse_error("word"), HasSubstr("is not a list of KEY: VALUE"));
  EXPECT_THAT(parse_error("a: 1\n? [b, c]\n: 2\n"),
              StartsWith("a.yaml:2: has a key that is a list"));
  EXPECT_THAT(parse_error(": 2\n"), HasSubstr("a value without a key"));
  EXPECT_THAT(parse_error("a: 1\n---\nb: 2\n"), HasSubstr("several documents"));
  EXPECT_EQ(parse_config({"a.yaml", "a: 1\n---\n"}).keys.size(), 1u) << "which begins none";
}

TEST(Config, HostileTextsAreRefused) {
  EXPECT_THAT(parse_error("a: &x [1, 2]\nb: [*x, *x]\n"), StartsWith("a.yaml:2: has an alias"));
  EXPECT_THAT(parse_error("a: " + std::string(100, '[') + std::string(100, ']')),
              AllOf(StartsWith("a.yaml:1"), HasSubstr("nested deeper than 32")));
  std::string blocks;
  for (int i = 0; i < 100; ++i) blocks += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_THAT(parse_error(blocks), AllOf(StartsWith("a.yaml:33"), HasSubstr("nested deeper")));
  EXPECT_THAT(parse_error(std::string((std::size_t{1} << 20) + 1, ' ')), HasSubstr("1 MiB"));
  std::string many = "a: [";
  for (int i = 0; i < 150000; ++i) many += "1,";
  EXPECT_THAT(parse_error(many + "]"), HasSubstr("more than 100000 values"));
  EXPECT_THAT(parse_error(std::string("a: 1\nb: \0\n", 10)),
              "a.yaml:2: has the byte 0x00, expected YAML text");
  EXPECT_THAT(parse_error("\xff\xfe"
                          "a\n"),
              HasSubstr("has the byte 0xff"));
  EXPECT_THAT(parse_error("\x89PNG\r\n\x1a\n"), HasSubstr("has the byte 0x1a"));
  EXPECT_THAT(parse_error("\"a\\nb\": 1\n"),
              "a.yaml:1: has a key of several lines, expected KEY: VALUE");
  EXPECT_THAT(parse_error("a: \"\\\rb\""),
              "a.yaml:1: is not valid YAML (unknown escape character: \\x0d)");
}

// Openings that never close, of every kind, in the size that is allowed at most.
TEST(Config, EndlessNestingEnds) {
  for (const char* opening :
       {"[", "{", "- ", "? ", "{a: ", "[{", "a: [", "!x ", "&x ", "\"", "'", "|"}) {
    std::string text;
    while (text.size() < 30000) text += opening;
    EXPECT_NE(parse_error(text), "no error") << opening;
  }
}

TEST(Config, RandomTextsNeverCrash) {
  const std::string alphabet = "ab:-?[]{},&*!|>'\"%@` \n\t#0.~<=";
  Rng rng(11, 0);
  int num_refused = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string text;
    const std::uint32_t length = rng.below(60);
    for (std::uint32_t i = 0; i < length; ++i) {
      text += alphabet[rng.below(static_cast<std::uint32_t>(alphabet.size()))];
    }
    try {
      parse(text);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), StartsWith("a.yaml")) << text;
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, 1000);
  EXPECT_LT(num_refused, 5000);
}

TEST(Config, FilesAreReadWhole) {
  const std::string path = ::testing::TempDir() + "waymark_config_test.yaml";
  std::ofstream(path) << "a: 1\n";
  const ConfigSource source = ConfigSource::from_file(path);
  EXPECT_EQ(source.name, path);
  EXPECT_EQ(source.text, "a: 1\n");
  std::ofstream(path) << std::string((std::size_t{1} << 20) + 1, ' ');
  EXPECT_THAT(error_of([&] { ConfigSource::from_file(path); }), HasSubstr("larger than 1 MiB"));
  std::filesystem::remove(path);
  EXPECT_EQ(error_of([&] { ConfigSource::from_file(path); }),
            path + ": cannot be opened, expected a YAML file");
  EXPECT_THAT(error_of([&] { ConfigSource::from_file(::testing::TempDir()); }),
              HasSubstr("is a folder"));
}

}  // namespace
}  // namespace waymark

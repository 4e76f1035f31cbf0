// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/settings.h"

#include <gmock/gmock.h>

#include <sstream>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct InnerSettings {
  double ratio = 0.25;
  std::vector<double> mask = {0.0, 1.0};

  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("ratio", self.ratio, SettingInfo{.low = 0.0, .high = 1.0, .help = "Part of the whole."});
    field("mask", self.mask, SettingInfo{.low = 0.0, .unit = "px", .help = "Rectangle."});
  }
};

struct TrackingSettings {
  int min_matches = 20;
  bool is_fast = false;
  std::string mode = "a \"b\"";
  InnerSettings inner;

  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field(
        "min_matches",
        self.min_matches,
        SettingInfo{.low = 10, .high = 1000, .unit = "matches", .help = "Fewer are not trusted."});
    field("is_fast", self.is_fast, SettingInfo{});
    field("mode", self.mode, SettingInfo{.help = "Any text."});
    field("inner", self.inner, SettingInfo{.help = "A section in a section."});
  }
};

struct TestSettings {
  int seed = 0;
  TrackingSettings tracking;

  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("seed", self.seed, SettingInfo{.low = 0, .help = "Of random numbers."});
    field("tracking", self.tracking, SettingInfo{.help = "Pose of each frame."});
  }
};

TestSettings read(const std::vector<ConfigSource>& sources) {
  TestSettings settings;
  read_settings(settings, sources);
  return settings;
}

std::string error_of(const std::string& text) {
  try {
    read({{"a.yaml", text}});
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Settings, ListsFieldsInOrder) {
  TestSettings settings;
  std::vector<std::string> keys;
  for (const SettingField& field : list_settings(settings)) keys.push_back(field.key);
  EXPECT_THAT(keys,
              ElementsAre("seed",
                          "tracking",
                          "tracking.min_matches",
                          "tracking.is_fast",
                          "tracking.mode",
                          "tracking.inner",
                          "tracking.inner.ratio",
                          "tracking.inner.mask"));
}

TEST(Settings, ReadsWhatIsWrittenAndKeepsTheRest) {
  const TestSettings settings =
      read({{"a.yaml", "seed: 3\ntracking:\n  min_matches: 30\n  inner: {ratio: 0.5}\n"},
            {"b.yaml", "tracking: {is_fast: true, mode: c, inner: {mask: [1, 2, 3]}}"},
            ConfigSource::from_assignment("tracking.min_matches=40")});
  EXPECT_EQ(settings.seed, 3);
  EXPECT_EQ(settings.tracking.min_matches, 40);
  EXPECT_TRUE(settings.tracking.is_fast);
  EXPECT_EQ(settings.tracking.mode, "c");
  EXPECT_EQ(settings.tracking.inner.ratio, 0.5);
  EXPECT_THAT(settings.tracking.inner.mask, ElementsAre(1.0, 2.0, 3.0));
  EXPECT_EQ(read({}).tracking.min_matches, 20);
  EXPECT_EQ(read({{"a.yaml", "tracking:\n"}}).tracking.min_matches, 20);
}

TEST(Settings, ErrorsNameWhatWasExpected) {
  EXPECT_EQ(error_of("seed: 1\ntracking:\n  min_matches: 7\n"),
            "a.yaml:3: tracking.min_matches is 7, expected an integer from 10 to 1000");
  EXPECT_EQ(error_of("tracking:\n  inner:\n    ratio: .nan\n"),
            "a.yaml:3: tracking.inner.ratio is .nan, expected a number from 0 to 1");
  EXPECT_EQ(error_of("tracking: 5\n"), "a.yaml:1: tracking is 5, expected a section of KEY: VALUE");
  EXPECT_EQ(error_of("seed: {a: 1}\n"),
            "a.yaml:1: seed is a section, expected an integer of at least 0");
  EXPECT_EQ(error_of("tracking: {inner: {mask: [1, -1]}}"),
            "a.yaml:1: tracking.inner.mask[1] is -1, expected a number of at least 0");
}

TEST(Settings, UnknownKeysAreErrors) {
  EXPECT_EQ(error_of("\ntracking:\n  min_match: 30\n"),
            "a.yaml:3: unknown key 'tracking.min_match', did you mean 'tracking.min_matches'?");
  EXPECT_THAT(error_of("sede: 1"), EndsWith("did you mean 'seed'?"));
  EXPECT_THAT(error_of("cma0: {}"), EndsWith("did you mean 'cam0'?"));
  EXPECT_THAT(error_of("tracking.min_matches: 30"), HasSubstr("expected sections instead of dots"));
  EXPECT_THAT(error_of("camera: {}"), HasSubstr("unknown key"));
}

TEST(Settings, UnknownKeysOfAssignmentsAreErrors) {
  try {
    read({ConfigSource::from_assignment("tracking.min_matchs=30")});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "--set tracking.min_matchs=30: unknown key 'tracking.min_matchs', did you mean "
                 "'tracking.min_matches'?");
  }
}

TEST(Settings, TheCalibrationIsPassedOver) {
  EXPECT_EQ(
      read({{"a.yaml", "cam0: {x: 1}\ncam1: 2\ncam12: 3\ndepth: {factor: 5000}\nseed: 4\n"}}).seed,
      4);
  EXPECT_THAT(error_of("depth: {fctor: 5000}"), EndsWith("did you mean 'depth.factor'?"));
  EXPECT_THAT(error_of("depth: 5000"), HasSubstr("expected a section"));
}

TEST(Settings, ChangedOnesAreListed) {
  TestSettings settings;
  EXPECT_TRUE(changed_settings(settings).empty());
  settings.seed = 7;
  settings.tracking.inner.ratio = 0.75;
  EXPECT_THAT(changed_settings(settings),
              ::testing::ElementsAre("seed: 7", "tracking.inner.ratio: 0.75"));
}

TEST(Settings, PrintedYamlReadsBack) {
  TestSettings settings;
  settings.seed = 7;
  settings.tracking.mode = "quotes \" and \\ and: #";
  settings.tracking.inner.ratio = 0.1;
  settings.tracking.inner.mask = {1e-7, 3.0};
  const std::string yaml = settings_as_yaml(settings);
  const TestSettings again = read({{"a.yaml", yaml}});
  EXPECT_EQ(again.seed, 7);
  EXPECT_EQ(again.tracking.mode, settings.tracking.mode);
  EXPECT_EQ(again.tracking.inner.ratio, 0.1);
  EXPECT_EQ(again.tracking.inner.mask, settings.tracking.inner.mask);
  EXPECT_THAT(
      yaml,
      HasSubstr("  # Fewer are not trusted. (integer from 10 to 1000, in matches; default 20)\n"
                "  min_matches: 20\n"));
  EXPECT_THAT(yaml, HasSubstr("(integer of at least 0; default 0)\nseed: 7\n"));
  EXPECT_THAT(yaml, HasSubstr("\n\n# Pose of each frame.\ntracking:\n"));
  std::istringstream lines(yaml);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u);
}

TEST(Settings, MarkdownHasARowPerSetting) {
  const std::string table = settings_as_markdown<TestSettings>();
  EXPECT_THAT(table, StartsWith("| key |"));
  EXPECT_THAT(
      table,
      HasSubstr("| `tracking.min_matches` | `20` | integer from 10 to 1000 | matches | Fewer are "
                "not trusted. |\n"));
  EXPECT_THAT(table, HasSubstr("\n\n## tracking\n\n"));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "waymark/report/testing/recorded_figures.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Changes what a run that went well has recorded.
using Spoil = std::function<void(FrameTable&, RunSummary&)>;

std::vector<RunAdvice> advice_after(const Spoil& spoil) {
  FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  spoil(table, summary);
  return advise(table, summary);
}

std::vector<std::string> causes_after(const Spoil& spoil) {
  std::vector<std::string> causes;
  for (const RunAdvice& advice : advice_after(spoil)) causes.push_back(advice.cause);
  return causes;
}

/// Frames are lost for want of matches, with such images.
std::vector<std::string> causes_with(ImageStatistics picture, int num_features = 1000) {
  return causes_after([&](FrameTable& table, RunSummary&) {
    lose(table, 100, 200);
    for (std::uint32_t i = 100; i < 200; ++i) {
      table.frames[i].picture = picture;
      table.frames[i].num_features = static_cast<std::uint16_t>(num_features);
    }
  });
}

TEST(Advice, NoneWhereAllWentWell) {
  EXPECT_THAT(causes_after([](FrameTable&, RunSummary&) {}), IsEmpty());
  EXPECT_THAT(advise({}, {}), IsEmpty());
}

TEST(Advice, OfImages) {
  EXPECT_THAT(causes_with({30, 9, 15, true}), Contains("dark"));
  EXPECT_THAT(causes_with({118, 20, 38, true}), Contains("flat"));
  EXPECT_THAT(causes_with({110, 60, 62, true}), Contains("blur"));
  EXPECT_THAT(causes_with({110, 60, 44, true}), Contains("blur")) << "28 where all goes well";
  EXPECT_THAT(causes_with({110, 60, 30, true}, 120), Contains("few_features"));
}

TEST(Advice, OfGoodImagesBlamesTheMotion) {
  const std::vector<std::string> causes = causes_with({110, 60, 30, true});
  EXPECT_THAT(causes, Contains("fast_motion"));
  for (const char* cause : {"dark", "flat", "blur", "few_features"}) {
    EXPECT_THAT(causes, Not(Contains(cause)));
  }
}

TEST(Advice, OfDarkImagesThatAreTrackedIsNone) {
  EXPECT_THAT(causes_after([](FrameTable& table, RunSummary&) {
                for (FrameRecord& frame : table.frames) frame.picture = {30, 9, 60, true};
              }),
              IsEmpty());
}

TEST(Advice, OfImagesNobodyMeasuredBlamesNoImage) {
  EXPECT_THAT(causes_with({}), Not(Contains("dark")));
}

TEST(Advice, TellsFiguresRemedyAndSection) {
  const std::vector<RunAdvice> advice = advice_after([](FrameTable& table, RunSummary&) {
    lose(table, 0, 400);
    for (FrameRecord& frame : table.frames) frame.picture = {31, 9, 15, true};
  });
  ASSERT_FALSE(advice.empty());
  EXPECT_EQ(advice[0].cause, "dark");
  EXPECT_THAT(advice[0].seen, HasSubstr("brightness 31 and contrast 9 of 255"));
  EXPECT_THAT(advice[0].remedy, HasSubstr("more light"));
  EXPECT_EQ(advice[0].see, "docs/troubleshooting.md#the-images-are-dark");
}

TEST(Advice, OfMonoWithoutParallax) {
  const auto never = [](FrameTable& table, RunSummary&) {
    lose(table, 0, 400, FrameReason::kTooLittleParallax, FrameState::kInitializing);
  };
  EXPECT_THAT(causes_after(never), Contains("no_parallax"));
  const auto shortly = [](FrameTable& table, RunSummary&) {
    lose(table, 0, 12, FrameReason::kTooLittleParallax, FrameState::kInitializing);
  };
  EXPECT_THAT(causes_after(shortly), IsEmpty());
}

TEST(Advice, OfPairsThatDoNotStart) {
  const auto never = [](FrameTable& table, RunSummary& summary) {
    lose(table, 0, 400, FrameReason::kTooFewMatches, FrameState::kInitializing);
    summary.setup = "stereo";
  };
  EXPECT_THAT(causes_after(never), Contains("pair"));
  EXPECT_THAT(causes_after(never), Not(Contains("fast_motion")));
  const auto named = [&](FrameTable& table, RunSummary& summary) {
    never(table, summary);
    summary.mistakes = {"calibration: left and right images are swapped?"};
  };
  EXPECT_THAT(causes_after(named), Not(Contains("pair"))) << "a mistake was named already";
}

TEST(Advice, OfCalibrationsThatDoNotFit) {
  const auto residuals = [](FrameTable&, RunSummary& summary) {
    summary.quality->reprojection_px = 1.4;
  };
  EXPECT_THAT(causes_after(residuals), Contains("calibration"));
  const auto matches = [](FrameTable&, RunSummary& summary) {
    summary.quality->matches_kept = 0.5;
  };
  EXPECT_THAT(causes_after(matches), Contains("calibration"));
  const auto contradictions = [](FrameTable& table, RunSummary&) {
    lose(table, 0, 200, FrameReason::kTooFewInliers);
  };
  EXPECT_THAT(causes_after(contradictions), Contains("calibration"));
  const auto named = [](FrameTable&, RunSummary& summary) {
    summary.quality->reprojection_px = 1.4;
    summary.mistakes = {"calibration: by the residuals ..."};
  };
  EXPECT_THAT(causes_after(named), IsEmpty());
}

TEST(Advice, OfCoarseImages) {
  const auto coarse = [](FrameTable&, RunSummary& summary) {
    summary.quality->reprojection_px = 0.5;
    summary.quality->reprojection_percent = 0.32;
  };
  EXPECT_THAT(causes_after(coarse), ::testing::ElementsAre("coarse"));
  EXPECT_THAT(advice_after(coarse)[0].seen, HasSubstr("0.50 px is 0.32 % of images"));
}

TEST(Advice, OfJumpsInTimeThatDidHarm) {
  const auto jump = [](FrameTable& table, RunSummary&) {
    for (std::uint32_t i = 200; i < 400; ++i) table.frames[i].timestamp_ns += 500'000'000;
  };
  EXPECT_THAT(causes_after(jump), IsEmpty());
  const auto harmful = [&](FrameTable& table, RunSummary& summary) {
    jump(table, summary);
    lose(table, 200, 215);
  };
  EXPECT_THAT(causes_after(harmful), Contains("jumps"));
  EXPECT_THAT(advice_after(harmful)[0].seen, HasSubstr("1 before frames"));
  EXPECT_THAT(advice_after(harmful)[0].seen, HasSubstr("11 times"));
}

TEST(Advice, OfImagesThatAreMissing) {
  EXPECT_THAT(causes_after([](FrameTable& table, RunSummary&) {
                lose(table, 10, 60, FrameReason::kLate, FrameState::kDropped);
              }),
              Contains("late"));
  EXPECT_THAT(causes_after([](FrameTable& table, RunSummary&) {
                lose(table, 10, 20, FrameReason::kUnreadableImage, FrameState::kUnreadable);
              }),
              Contains("unreadable"));
}

TEST(Advice, OfLossesAndParts) {
  const auto lost = [](FrameTable& table, RunSummary& summary) {
    for (std::uint32_t i = 50; i < 350; i += 100) lose(table, i, i + 3);
    summary.submaps = 3;
  };
  EXPECT_THAT(causes_after(lost), Contains("losses"));
  EXPECT_THAT(causes_after(lost), Contains("parts"));
}

TEST(Advice, OfImagesThatAreNotInTheMap) {
  const auto localized = [](FrameTable& table, RunSummary& summary) {
    lose(table, 0, 300, FrameReason::kNoCandidate);
    summary.localized = 100;
    summary.submaps = 2;
    summary.quality.reset();
    summary.mistakes.reset();
  };
  EXPECT_THAT(causes_after(localized), ::testing::ElementsAre("not_in_map"));
}

TEST(Advice, EachCauseHasAName) {
  std::set<std::string> names;
  for (const AdviceCause& cause : advice_causes()) names.insert(cause.name);
  EXPECT_EQ(names.size(), advice_causes().size());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/assessment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/report/testing/recorded_figures.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

Assessment verdict_of(const FrameTable& table, RunSummary summary) {
  return judge(table, summary, nullptr);
}

const Judgement& judgement_of(const Assessment& verdict, const std::string& name) {
  for (const Judgement& judgement : verdict.judgements) {
    if (judgement.name == name) return judgement;
  }
  ADD_FAILURE() << "nothing judges " << name;
  return verdict.judgements.front();
}

TEST(Assessment, OfARunThatWentWellIsGood) {
  const FrameTable table = good_table();
  const Assessment verdict = verdict_of(table, good_summary(table));
  EXPECT_EQ(verdict.grade, Grade::kGood);
  EXPECT_EQ(judgement_of(verdict, "Coverage").value, "100 %");
  EXPECT_EQ(judgement_of(verdict, "Inliers").value, "200");
  EXPECT_EQ(verdict.names_of(Grade::kBad), "");
}

TEST(Assessment, IsTheWorstGrade) {
  FrameTable table = good_table();
  lose(table, 100, 180);
  Assessment verdict = verdict_of(table, good_summary(table));
  EXPECT_EQ(verdict.grade, Grade::kCheck);
  EXPECT_EQ(verdict.names_of(Grade::kCheck), "Coverage, Losses");
  lose(table, 180, 300);
  verdict = verdict_of(table, good_summary(table));
  EXPECT_EQ(verdict.grade, Grade::kBad);
  EXPECT_EQ(verdict.names_of(Grade::kBad), "Coverage");
  EXPECT_EQ(judgement_of(verdict, "Coverage").value, "50 %");
}

TEST(Assessment, OfAFocalLengthThatTheImagesContradict) {
  const FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  summary.refined_calibration = {{"cam0.fu", 500.0, 10.0, 20.0, 1.0}};
  EXPECT_EQ(verdict_of(table, summary).grade, Grade::kGood) << "2 % happen";
  summary.refined_calibration[0].change = 40.0;
  Assessment verdict = verdict_of(table, summary);
  EXPECT_EQ(verdict.grade, Grade::kCheck);
  EXPECT_EQ(judgement_of(verdict, "Calibration").value, "off by 8.0 %");
  summary.refined_calibration.clear();
  summary.mistakes = {"calibration: by the residuals the focal length is 7.3 % shorter"};
  verdict = verdict_of(table, summary);
  EXPECT_EQ(verdict.grade, Grade::kCheck);
  EXPECT_THAT(judgement_of(verdict, "Calibration").why, HasSubstr("7.3 % shorter"));
}

TEST(Assessment, OfPartsThatDidNotJoin) {
  const FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  summary.submaps = 2;
  EXPECT_EQ(verdict_of(table, summary).names_of(Grade::kCheck), "Parts of the map");
}

TEST(Assessment, OfResiduals) {
  const FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  summary.quality->reprojection_px = 2.0;
  summary.quality->matches_kept = 0.7;
  const Assessment verdict = verdict_of(table, summary);
  EXPECT_EQ(verdict.names_of(Grade::kBad), "Reprojection error");
  EXPECT_EQ(verdict.names_of(Grade::kCheck), "Matches kept");
}

TEST(Assessment, OfImagesThatAreCoarse) {
  const FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  summary.quality->reprojection_px = 0.5;
  summary.quality->reprojection_percent = 0.32;
  const Assessment verdict = verdict_of(table, summary);
  EXPECT_EQ(verdict.grade, Grade::kCheck);
  EXPECT_EQ(verdict.names_of(Grade::kCheck), "Reprojection error");
}

TEST(Assessment, OfTheErrorAgainstTheTruth) {
  const FrameTable table = good_table();
  Evaluation truth;
  truth.ate_m.rmse = 0.1;
  truth.ate_percent = 0.5;
  EXPECT_EQ(judge(table, good_summary(table), &truth).grade, Grade::kGood);
  truth.ate_percent = 2.0;
  EXPECT_EQ(judge(table, good_summary(table), &truth).grade, Grade::kCheck);
  truth.ate_percent = 5.0;
  EXPECT_EQ(judge(table, good_summary(table), &truth).grade, Grade::kBad);
  truth.ate_m.rmse = 0.01;
  EXPECT_EQ(judge(table, good_summary(table), &truth).grade, Grade::kGood) << "of a short path";
}

TEST(Assessment, OfNothing) { EXPECT_EQ(judge({}, {}, nullptr).grade, Grade::kBad); }

}  // namespace
}  // namespace waymark

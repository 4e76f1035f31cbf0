// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/report/testing/recorded_figures.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::waymark::testing::TemporaryFolder;

/// What an error of reading says; empty where there is none.
template <class Read>
std::string fault_of(Read&& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(RunFolder, FramesReadBackAsWritten) {
  FrameTable table = good_table(5);
  lose(table, 2, 3, FrameReason::kNotVerified);
  table.frames[3].is_relocalized = true;
  table.frames[4] = FrameRecord{};
  table.frames[4].timestamp_ns = 2'000'000'000;
  table.frames[4].state = FrameState::kUnreadable;
  table.frames[4].reason = FrameReason::kUnreadableImage;
  const std::string text = format_frames_csv(table);
  const FrameTable again = parse_frames_csv(text, "frames.csv");
  EXPECT_EQ(again.stages, table.stages);
  EXPECT_EQ(again.frames[2].reason, FrameReason::kNotVerified);
  EXPECT_EQ(again.frames[1].num_features, 1000);
  EXPECT_EQ(again.frames[1].picture.contrast, 50);
  EXPECT_FALSE(again.frames[4].num_features);
  EXPECT_FALSE(again.frames[4].picture.is_known);
  EXPECT_TRUE(again.frames[3].is_relocalized);
  // Times of a frame that was not processed are written as 0, and come back as such.
  EXPECT_EQ(format_frames_csv(again), text);
}

TEST(RunFolder, FramesOfEarlierVersionsLackFigures) {
  const FrameTable table = parse_frames_csv(
      "index,timestamp_ns,state,reason,matches,inliers,is_keyframe,submap,features_ms\n"
      "7,1000,tracked,none,12,10,1,0,2.5\n",
      "frames.csv");
  ASSERT_EQ(table.frames.size(), 1u);
  EXPECT_EQ(table.frames[0].index, 7u);
  EXPECT_FALSE(table.frames[0].num_features);
  EXPECT_FALSE(table.frames[0].picture.is_known);
}

TEST(RunFolder, WrongFramesAreNamed) {
  const std::string head = "index,timestamp_ns,state,reason,matches,inliers\n";
  const auto fault = [&](const std::string& rows) {
    return fault_of([&] { parse_frames_csv(rows, "frames.csv"); });
  };
  EXPECT_THAT(fault(""), HasSubstr("frames.csv: is empty, expected"));
  EXPECT_THAT(fault("a,b\n"), HasSubstr("has no column 'index'"));
  EXPECT_THAT(fault(head + "1,2\n"), HasSubstr("frames.csv:2"));
  EXPECT_THAT(fault(head + "-1,2,tracked,none,1,1\n"),
              HasSubstr("'index' is '-1', expected a whole"));
  EXPECT_THAT(fault(head + "1,2,flying,none,1,1\n"), HasSubstr("'flying' is no state or reason"));
  EXPECT_THAT(fault(head + "1,-2,tracked,none,1,1\n"), HasSubstr("frames.csv:2"));
  EXPECT_THAT(fault("index,timestamp_ns,state,reason,matches,inliers,a_ms,b_ms,c_ms,d_ms,e_ms,f_ms,"
                    "g_ms,h_ms,i_ms\n"),
              HasSubstr("too many columns"));
  EXPECT_EQ(fault(head), "");
}

TEST(RunFolder, SummaryReadsBackAsWritten) {
  const FrameTable table = good_table();
  RunSummary summary = good_summary(table);
  summary.loop_frames = {{3, 90}, {std::nullopt, 7}};
  summary.refined_calibration = {{"cam0.fu", 500.0, 5.0, 40.0, 1.5}};
  summary.calibration = EstimatedCalibrationSummary{"fisheye", 300.0, 2.0, 160.0, true};
  summary.settings = {"seed: 7"};
  summary.mistakes = {"calibration: <b>"};
  summary.stages_ms = summarize_stages(table);
  summary.localized = 4;
  const RunSummary again = parse_summary_json(format_summary_json(summary), "summary.json");
  EXPECT_EQ(again.loop_frames[0].to, 90u);
  EXPECT_FALSE(again.loop_frames[1].from);
  EXPECT_EQ(again.refined_calibration[0].change, 5.0);
  EXPECT_EQ(again.calibration->model, "fisheye");
  EXPECT_EQ(again.settings, summary.settings);
  EXPECT_EQ(again.mistakes, summary.mistakes);
  EXPECT_EQ(again.stages_ms[0].first, "features");
  EXPECT_EQ(again.stages_ms[0].second.mean, 4.0);
  EXPECT_EQ(again.quality->reprojection_percent, 0.08);
  EXPECT_EQ(again.quality->matches_kept, 0.9);
  EXPECT_EQ(again.localized, 4u);
  EXPECT_EQ(again.landmarks, 3000u);
}

TEST(RunFolder, WrongSummariesAreNamed) {
  const auto fault = [&](const std::string& text) {
    return fault_of([&] { parse_summary_json(text, "summary.json"); });
  };
  EXPECT_THAT(fault("{"), HasSubstr("summary.json: is no JSON at byte"));
  EXPECT_THAT(fault("[]"), HasSubstr("is no object"));
  EXPECT_THAT(fault("{}"), HasSubstr("has no 'frames'"));
  EXPECT_THAT(fault(R"({"frames": 1, "keyframes": -1})"),
              HasSubstr("'keyframes' is something else"));
  EXPECT_THAT(fault(R"({"frames": 1, "keyframes": 1e300})"), HasSubstr("'keyframes'"));
  EXPECT_THAT(fault(R"({"frames": 1, "mistakes": "x"})"), HasSubstr("'mistakes'"));
  EXPECT_THAT(fault(R"({"frames": 1, "mistakes": [1]})"), HasSubstr("'mistakes'"));
  EXPECT_THAT(fault(R"({"frames": 1, "quality": []})"), HasSubstr("quality: is no object"));
  EXPECT_THAT(fault(R"({"frames": 1, "loop_frames": [[1]]})"), HasSubstr("'loop_frames'"));
  EXPECT_THAT(fault(R"({"frames": 1, "loop_frames": [[1, -5]]})"), HasSubstr("'loop_frames'"));
  EXPECT_THAT(fault(R"({"frames": 1, "refined_calibration": [3]})"), HasSubstr("is no object"));
  EXPECT_THAT(fault(std::string(200'000, '[')), HasSubstr("is no JSON"));
  EXPECT_EQ(fault(R"({"frames": 1})"), "");
}

TEST(RunFolder, MomentsReadBackAsWritten) {
  std::vector<NavigationState> states(2);
  states[1].timestamp_ns = 50;
  states[1].velocity = {1.0, -2.0, 3.0};
  states[1].biases = {{0.1, 0.2, 0.3}, {4.0, 5.0, 6.0}};
  const std::string text = format_inertial_csv(states);
  const auto read = parse_inertial_csv(text, "a");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].velocity, states[1].velocity);
  EXPECT_EQ(read[1].biases.gyroscope, states[1].biases.gyroscope);
  EXPECT_EQ(read[1].biases.accelerometer, states[1].biases.accelerometer);
  const std::string last = text.substr(text.rfind('\n', text.size() - 2) + 1);
  EXPECT_THAT(fault_of([&] { parse_inertial_csv(text + last, "a"); }), HasSubstr("a:4"));
  EXPECT_THAT(fault_of([&] { parse_inertial_csv(text + "1,2\n", "a"); }), HasSubstr("a:4"));
}

TEST(RunFolder, PointsReadBackAsWritten) {
  const std::vector<Eigen::Vector3f> points = {{1.0f, -2.5f, 0.125f}, {0.0f, 0.0f, 1e6f}};
  EXPECT_EQ(parse_points_ply(format_points_ply(points), "points.ply"), points);
  EXPECT_THAT(fault_of([] { parse_points_ply("ply\nformat binary", "points.ply"); }),
              HasSubstr("points.ply: has no head"));
  EXPECT_THAT(
      fault_of([&] { parse_points_ply(format_points_ply(points) + "1 2\n", "points.ply"); }),
      HasSubstr("expected"));
  EXPECT_THAT(
      fault_of([&] { parse_points_ply(format_points_ply(points) + "1 2 3\n", "points.ply"); }),
      HasSubstr("has 3 points, expected 2"));
}

class WrittenRun : public ::testing::Test {
 protected:
  void SetUp() override {
    FrameTable table = good_table(20);
    write_frames_csv(folder_.path(), table);
    write_summary_json(folder_.path(), good_summary(table));
    std::vector<std::vector<StampedPose>> parts(2);
    for (int i = 0; i < 20; ++i)
      parts[i < 15 ? 0 : 1].push_back({table.frames[i].timestamp_ns, {}});
    write_trajectories(folder_.path(), parts);
    write_file_atomically(folder_ / "points.ply", format_points_ply({}));
  }
  std::string fault() const {
    return fault_of([&] { read_run_folder(folder_.path()); });
  }

  const TemporaryFolder folder_;
};

TEST_F(WrittenRun, IsReadWhole) {
  const RunFolder run = read_run_folder(folder_.path());
  EXPECT_EQ(run.name, folder_.path().filename().string());
  EXPECT_EQ(run.trajectories.size(), 2u);
  EXPECT_EQ(run.summary.num_trajectory_lines, 15u);
  EXPECT_EQ(run.summary.counts.frames, 20u);
}

TEST_F(WrittenRun, OfAnEarlierVersionHasNoPoints) {
  std::filesystem::remove(folder_ / "points.ply");
  EXPECT_TRUE(read_run_folder(folder_.path()).points.empty());
}

TEST_F(WrittenRun, MissesFilesByName) {
  for (const char* name : {"summary.json", "frames.csv", "trajectory.txt"}) {
    const std::string text = read_text_file(folder_ / name, "it");
    std::filesystem::remove(folder_ / name);
    EXPECT_THAT(fault(), HasSubstr(name));
    write_file_atomically(folder_ / name, text);
  }
  EXPECT_THAT(fault_of([&] { read_run_folder(folder_ / "gone"); }), HasSubstr("is no folder"));
}

TEST_F(WrittenRun, RefusesPositionsBeyondTheWorld) {
  write_file_atomically(folder_ / "trajectory.txt", "1.0 1e300 0 0 0 0 0 1\n");
  EXPECT_THAT(fault(), HasSubstr("has a position beyond"));
}

TEST_F(WrittenRun, RefusesFilesThatAreCut) {
  for (const char* name : {"summary.json", "frames.csv", "trajectory.txt"}) {
    const std::string text = read_text_file(folder_ / name, "it");
    write_file_atomically(folder_ / name, text.substr(0, text.size() - 30));
    EXPECT_NE(fault(), "") << name;
    write_file_atomically(folder_ / name, text);
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/results/results.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using testing::TemporaryFolder;

FrameRecord make_record(std::size_t index,
                        FrameState state,
                        FrameReason reason = FrameReason::kNone) {
  FrameRecord record;
  record.index = index;
  record.timestamp_ns = static_cast<std::int64_t>(index) * 1000;
  record.state = state;
  record.reason = reason;
  return record;
}

FrameTable make_table() {
  FrameTable table;
  table.stages = {"features", "wait"};
  table.frames = {make_record(10, FrameState::kInitializing, FrameReason::kTooLittleParallax),
                  make_record(11, FrameState::kFilled),
                  make_record(12, FrameState::kTracked),
                  make_record(13, FrameState::kLost, FrameReason::kTooFewMatches),
                  make_record(14, FrameState::kUnreadable, FrameReason::kUnreadableImage),
                  make_record(15, FrameState::kLost, FrameReason::kNoCandidate),
                  make_record(16, FrameState::kTracked),
                  make_record(17, FrameState::kLost, FrameReason::kNotVerified),
                  make_record(18, FrameState::kDropped, FrameReason::kLate)};
  table.frames[2].num_matches = 120;
  table.frames[2].num_inliers = 90;
  table.frames[2].is_keyframe = true;
  table.frames[2].submap = SubmapId{3};
  table.frames[2].set_stages(std::array{4.5, 0.25});
  table.frames[6].set_stages(std::array{5.5, 0.75});
  return table;
}

TEST(Results, CountsFollowFromTheRows) {
  const FrameCounts counts = count_frames(make_table().frames);
  EXPECT_EQ(counts.frames, 9u);
  EXPECT_EQ(counts.tracked, 3u);
  EXPECT_EQ(counts.filled, 1u);
  EXPECT_EQ(counts.unreadable, 1u);
  EXPECT_EQ(counts.dropped, 1u);
  EXPECT_EQ(counts.initialized_at, std::size_t{12});
  EXPECT_EQ(counts.lost_count, 2u);  // The unreadable frame does not split the first loss.
  EXPECT_FALSE(count_frames({}).initialized_at);
}

TEST(Results, StatisticsOfTimes) {
  std::vector<double> samples;
  for (int i = 100; i >= 1; --i) samples.push_back(i);
  const TimeStatistics times = summarize_times(samples);
  EXPECT_DOUBLE_EQ(times.mean, 50.5);
  EXPECT_DOUBLE_EQ(times.median, 50.5);
  EXPECT_DOUBLE_EQ(times.p95, 95.0);
  EXPECT_DOUBLE_EQ(times.max, 100.0);
  EXPECT_DOUBLE_EQ(summarize_times({7.0}).p95, 7.0);
  EXPECT_DOUBLE_EQ(summarize_times({}).max, 0.0);
}

TEST(Results, FramesCsvHasARowPerFrame) {
  FrameTable table = make_table();
  table.frames[2].num_features = 800;
  table.frames[2].picture = {120, 46, 31, true};
  table.frames[2].is_relocalized = true;
  const std::string text = format_frames_csv(table);
  EXPECT_THAT(
      text,
      ::testing::StartsWith(
          "index,timestamp_ns,state,reason,matches,inliers,is_keyframe,submap,features_ms,wait_ms,"
          "features,brightness,contrast,blur,is_relocalized\n"
          "10,10000,initializing,too_little_parallax,0,0,0,,0.0000,0.0000,,,,,0\n"));
  EXPECT_THAT(
      text,
      ::testing::HasSubstr("\n12,12000,tracked,none,120,90,1,3,4.5000,0.2500,800,120,46,31,1\n"));
  EXPECT_THAT(text, ::testing::HasSubstr("\n14,14000,unreadable,unreadable_image,"));
  EXPECT_THAT(text, ::testing::HasSubstr("\n18,18000,dropped,late,"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  table.frames[0].set_stages(std::array{1.0});
  EXPECT_THROW(format_frames_csv(table), CheckError);
}

TEST(Results, SummaryHasTheDocumentedKeys) {
  RunSummary summary;
  summary.counts = count_frames(make_table().frames);
  summary.num_trajectory_lines = 3;
  summary.stages_ms = summarize_stages(make_table());
  summary.tracking_ms = {1.0, 2.0, 3.0, 4.0};
  summary.setup = "mono";
  summary.timing = "lockstep";
  summary.version = "0.1.0";
  const nlohmann::json json = nlohmann::json::parse(format_summary_json(summary));
  for (const char* key :
       {"frames",         "tracked",        "filled",          "unreadable",   "dropped",
        "coverage",       "initialized_at", "lost_count",      "keyframes",    "landmarks",
        "submaps",        "loops",          "relocalizations", "wall_s",       "cpu_s",
        "peak_rss_mb",    "tracking_ms",    "mapping_ms",      "out_of_order", "without_partner",
        "missing_at_end", "stages_ms",      "setup",           "timing",       "seed",
        "version"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_FALSE(json.contains("localized"));
  EXPECT_EQ(json["coverage"], 0.3333);
  EXPECT_EQ(json["initialized_at"], 12);
  EXPECT_EQ(json["tracking_ms"]["p95"], 3.0);
  EXPECT_EQ(json["tracking_ms"]["max"], 4.0);
  EXPECT_EQ(json["stages_ms"]["features"]["mean"], 5.0);
  EXPECT_EQ(json["stages_ms"]["wait"]["median"], 0.5);
  summary.counts = {};
  summary.localized = 5;
  const nlohmann::json empty = nlohmann::json::parse(format_summary_json(summary));
  EXPECT_TRUE(empty["initialized_at"].is_null());
  EXPECT_EQ(empty["coverage"], 0.0);
  EXPECT_EQ(empty["localized"], 5);
}

TEST(Results, SummaryTellsLoopsSettingsAndAdvice) {
  RunSummary summary;
  summary.loop_frames = {{3, 90}, {std::nullopt, 7}};
  summary.settings = {"features.count: 1500"};
  summary.input = {"a video"};
  summary.advice = {{"dark", "brightness 20 of 255", "more light", "troubleshooting.md#x"}};
  const nlohmann::json json = nlohmann::json::parse(format_summary_json(summary));
  EXPECT_EQ(json["loop_frames"], nlohmann::json::parse("[[3, 90], [null, 7]]"));
  EXPECT_EQ(json["settings"][0], "features.count: 1500");
  EXPECT_EQ(json["input"][0], "a video");
  EXPECT_EQ(json["advice"][0]["cause"], "dark");
  EXPECT_EQ(json["advice"][0]["remedy"], "more light");
}

TEST(Results, PointsAreAPlyFile) {
  const std::vector<Eigen::Vector3f> points = {{1.0f, -2.5f, 0.125f}, {0.0f, 0.0f, 1e6f}};
  EXPECT_EQ(format_points_ply(points),
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n1 -2.5 0.125\n0 0 1e+06\n");
}

TEST(Results, TrajectoriesOfAnEarlierRunGo) {
  const TemporaryFolder folder;
  const std::vector<StampedPose> poses(2);
  std::vector<std::vector<StampedPose>> trajectories(4, poses);
  write_trajectories(folder.path(), trajectories);
  EXPECT_TRUE(std::filesystem::exists(folder / "trajectory_3.txt"));
  trajectories.resize(2);
  write_trajectories(folder.path(), trajectories);
  EXPECT_TRUE(std::filesystem::exists(folder / "trajectory_1.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder / "trajectory_2.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder / "trajectory_3.txt"));
  write_trajectories(folder.path(), {});
  EXPECT_EQ(read_text_file(folder / "trajectory.txt", "a trajectory"), "");
  EXPECT_THROW(write_trajectories(folder / "none", trajectories), OutputError);
}

TEST(Results, OfImagesWithoutTimesHaveNamesInstead) {
  FrameTable table;
  table.frames = {make_record(0, FrameState::kLost, FrameReason::kNoCandidate),
                  make_record(1, FrameState::kTracked)};
  table.frames[1].submap = SubmapId{2};
  table.names = {"a.jpg", "b, \"red\".jpg"};
  table.has_times = false;
  const std::string rows = format_frames_csv(table);
  EXPECT_NE(rows.find("is_relocalized,name\n0,,lost,"), std::string::npos) << rows;
  EXPECT_NE(rows.find(",\"b, \"\"red\"\".jpg\"\n"), std::string::npos) << rows;
  const std::vector<std::vector<StampedPose>> found = {
      {{1000, Rigid3(Eigen::Quaterniond::Identity(), {1.5, 0.0, -2.0})}}};
  EXPECT_EQ(format_poses_csv(table, found),
            "name,submap,tx,ty,tz,qx,qy,qz,qw\n\"b, \"\"red\"\".jpg\",2,1.5,0,-2,0,0,0,1\n");
  const TemporaryFolder folder;
  write_trajectories(folder.path(), found);
  write_trajectories(folder.path(), found, table.has_times);
  EXPECT_FALSE(std::filesystem::exists(folder / "trajectory.txt"));
}

TEST(Results, TellVelocityAndBiasesOfEachFrame) {
  NavigationState state;
  state.timestamp_ns = 5000;
  state.velocity = {1.0, -2.5, 0.0};
  state.covariance.diagonal() << 1.0, 4.0, 4.0, 9.0, 9.0, 9.0, 16.0, 0.0, 32.0;
  state.biases = {{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
  const std::string text = format_inertial_csv(std::vector{state});
  EXPECT_THAT(text,
              ::testing::HasSubstr("accel_bias_z\n5000,1,-2.5,0,1.73205,3,4,0.01,0.02,0.03,"));
}

TEST(Results, AreKnownByTheirFiles) {
  for (const char* name : {"trajectory.txt", "trajectory_12.txt", "poses.csv", "frames.csv"}) {
    EXPECT_TRUE(is_result_name(name)) << name;
  }
  for (const char* name : {"trajectory_.txt", "trajectory_a.txt", "groundtruth.txt", "m.wmap"}) {
    EXPECT_FALSE(is_result_name(name)) << name;
  }
  const TemporaryFolder folder;
  folder.write("frames.csv", "index,time\n");
  EXPECT_FALSE(holds_results(folder.path()));
  write_frames_csv(folder.path(), make_table());
  EXPECT_TRUE(holds_results(folder.path()));
  std::filesystem::remove(folder / "frames.csv");
  write_summary_json(folder.path(), {});
  EXPECT_TRUE(holds_results(folder.path()));
}

}  // namespace
}  // namespace waymark

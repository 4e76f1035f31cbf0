// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/report/drawing.h"
#include "waymark/report/testing/recorded_figures.h"
#include "waymark/report/timeline.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A circle of 4 m radius, level, in the frame of a camera that started level.
RunFolder circling_run() {
  RunFolder run;
  run.name = "circle";
  run.table = good_table();
  run.summary = good_summary(run.table);
  std::vector<StampedPose>& poses = run.trajectories.emplace_back();
  for (const FrameRecord& frame : run.table.frames) {
    const double angle = 0.01 * frame.index;
    StampedPose pose{frame.timestamp_ns, {}};
    pose.world_from_camera.translation = {4.0 * std::cos(angle), 0.0, 4.0 * std::sin(angle)};
    poses.push_back(pose);
  }
  run.points = {{1.0f, 0.5f, 1.0f}, {2.0f, -0.5f, 3.0f}};
  return run;
}

/// The same path, half as large again, as if measured.
TruePath truth_of(const RunFolder& run) {
  TruePath truth{"truth.txt", run.trajectories.front(), std::nullopt};
  for (StampedPose& pose : truth.poses) pose.world_from_camera.translation *= 1.5;
  return truth;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

TEST(Report, TellsWhatAnImuBrought) {
  RunFolder run = circling_run();
  EXPECT_THAT(format_report(run, nullptr), Not(HasSubstr("Inertial data")));
  run.summary.imu.emplace().reason = "it contradicts <the> images";
  EXPECT_THAT(format_report(run, nullptr), HasSubstr("Not used: it contradicts &lt;the&gt;"));
  run.summary.imu->is_used = true;
  run.summary.imu->scale_sigma = 0.0021;
  for (int i = 0; i < 3; ++i) {
    run.inertial.emplace_back().timestamp_ns = i * 1000;
    run.inertial.back().biases.gyroscope.x() = 0.01 * i;
  }
  const std::string page = format_report(run, nullptr);
  EXPECT_THAT(page, HasSubstr("known to 0.21 %"));
  EXPECT_THAT(page, HasSubstr("Bias of the gyroscope [degrees/s]"));
}

TEST(Report, SaysThatARunWentWell) {
  const std::string page = format_report(circling_run(), nullptr);
  EXPECT_THAT(page, HasSubstr("<h1>circle <span class=\"badge good\">good</span></h1>"));
  EXPECT_THAT(page, HasSubstr("<html lang=\"en\">"));
  EXPECT_THAT(page, HasSubstr("<title>Waymark report: circle</title>"));
  EXPECT_THAT(page, Not(HasSubstr("What to try")));
  EXPECT_THAT(page, HasSubstr("It stayed as given."));
}

TEST(Report, SaysWhatToTryAfterABadRun) {
  RunFolder run = circling_run();
  lose(run.table, 100, 400);
  for (std::uint32_t i = 100; i < 400; ++i) run.table.frames[i].picture = {30, 9, 15, true};
  run.trajectories.front().resize(100);
  run.summary = good_summary(run.table);
  run.summary.mistakes = {"calibration: by the residuals the focal length is 9 % shorter"};
  const std::string page = format_report(run, nullptr);
  EXPECT_THAT(page, HasSubstr("badge bad\">bad</span></h1>"));
  EXPECT_THAT(page, HasSubstr("Bad: Coverage. To check: Losses, Calibration."));
  EXPECT_THAT(page, HasSubstr("<h3>the images are dark: brightness 30"));
  EXPECT_THAT(page, HasSubstr("docs/troubleshooting.md#the-images-are-dark"));
  EXPECT_THAT(page, HasSubstr("the focal length is 9 % shorter"));
}

TEST(Report, AsksTheNetworkForNothing) {
  const std::string page = format_report(circling_run(), nullptr);
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST(Report, ShowsTextOfStrangersAsText) {
  const std::string evil = "</script><script>alert(1)</script>\"'&\x1b[2J";
  RunFolder run = circling_run();
  run.name = evil;
  run.summary.setup = run.summary.timing = run.summary.version = evil;
  run.summary.input = run.summary.settings = {evil};
  run.summary.mistakes = {evil};
  run.summary.stages_ms = {{evil, {}}};
  run.summary.refined_calibration = {{evil, 1.0, 1.0, 1.0, 1.0}};
  run.summary.calibration = EstimatedCalibrationSummary{evil, 1.0, 1.0, 1.0, true};
  TruePath truth = truth_of(run);
  truth.name = evil;
  const std::vector<RunFolder> runs = {run, run};
  for (const std::string& page : {format_report(run, &truth),
                                  format_run_comparison(runs, &truth),
                                  format_run_comparison(runs, nullptr)}) {
    EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
    EXPECT_THAT(page, Not(HasSubstr("\x1b")));
    EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(1)"));
    EXPECT_EQ(count(page, "<script"), count(page, "</script>"));
  }
}

TEST(Report, ComparesWithTheGroundTruth) {
  const RunFolder run = circling_run();
  const TruePath truth = truth_of(run);
  EXPECT_NEAR(evaluate_run(run, truth).groundtruth_from_estimate.scale, 1.5, 1e-9)
      << "mono is scaled";
  const std::string page = format_report(run, &truth);
  EXPECT_THAT(page, HasSubstr("Position error [m] over time"));
  EXPECT_THAT(page, HasSubstr("Position error [m] over the path"));
  EXPECT_THAT(page, HasSubstr("sim3, scale 1.5, 400 of 400 poses compared"));
  EXPECT_THAT(page, HasSubstr("class=\"truth\""));
  TruePath later = truth;
  for (StampedPose& pose : later.poses) pose.timestamp_ns += 1'000'000'000'000;
  EXPECT_THROW(format_report(run, &later), InputError);
}

TEST(Report, OfARunWithoutAPoseSaysSo) {
  RunFolder run = circling_run();
  lose(run.table, 0, 400, FrameReason::kTooLittleParallax, FrameState::kInitializing);
  run.summary = good_summary(run.table);
  run.trajectories.front().clear();
  const TruePath truth = truth_of(circling_run());
  const std::string page = format_report(run, &truth);
  EXPECT_THAT(page, HasSubstr("No frame got a pose"));
  EXPECT_THAT(page, HasSubstr("move the camera sideways"));
  run.table.frames.clear();
  EXPECT_THAT(format_report(run, nullptr), HasSubstr("There were no frames."));
}

TEST(Report, MarksLoopsAndRelocalisations) {
  RunFolder run = circling_run();
  EXPECT_THAT(format_report(run, nullptr), Not(HasSubstr("class=\"loop\"")));
  run.summary.loop_frames = {{3, 390}, {5, 4'000'000}};
  run.table.frames[200].is_relocalized = true;
  const std::string page = format_report(run, nullptr);
  EXPECT_EQ(count(page, "<circle class=\"loop\""), 3u) << "in each view";
  EXPECT_EQ(count(page, "<circle class=\"again\""), 3u);
  EXPECT_THAT(page, HasSubstr("<rect class=\"e-loop\" x=\"390\" width=\"1\""));
  EXPECT_THAT(page, HasSubstr("<rect class=\"e-again\" x=\"200\" width=\"1\""));
}

TEST(Report, PutsCalibrationBeforeAndAfterBesideEachOther) {
  RunFolder run = circling_run();
  run.summary.refined_calibration = {{"cam0.fu", 500.0, 40.0, 10.0, 2.0}};
  EXPECT_THAT(
      format_report(run, nullptr),
      HasSubstr("<td>cam0.fu</td><td>500 &plusmn; 10</td><td>540 &plusmn; 2</td><td>yes</td>"));
}

TEST(RunComparison, LaysRunsOverTheFirst) {
  std::vector<RunFolder> runs(2, circling_run());
  runs[1].name = "again";
  for (StampedPose& pose : runs[1].trajectories.front()) {
    pose.world_from_camera.translation =
        3.0 * pose.world_from_camera.translation + Eigen::Vector3d(50, 60, 70);
  }
  const std::string page = format_run_comparison(runs, nullptr);
  EXPECT_THAT(page, HasSubstr("2 runs compared"));
  EXPECT_THAT(page, HasSubstr("again"));
  const std::size_t first = page.find("class=\"path0\" d=\"M", page.find("From above"));
  const std::size_t second = page.find("class=\"path1\" d=\"M", page.find("From above"));
  EXPECT_EQ(page.substr(first + 17, 30), page.substr(second + 17, 30));
  for (StampedPose& pose : runs[1].trajectories.front()) pose.timestamp_ns += 1'000'000'000'000;
  EXPECT_THAT(format_run_comparison(runs, nullptr), HasSubstr("too few times in common"));
}

TEST(Timeline, ManyFramesShareAColumnThatShowsTheWorst) {
  FrameTable table = good_table(60'000);
  lose(table, 30'000, 30'001);
  const std::string html = draw_timelines(table, good_summary(table));
  EXPECT_THAT(html, HasSubstr("100 frames share a column"));
  EXPECT_THAT(html, HasSubstr("<rect class=\"s-lost\" x=\"300\" width=\"1\""));
  EXPECT_LT(html.size(), 200'000u);
}

TEST(Timeline, FiguresThatWereNotRecordedAreLeftOut) {
  FrameTable table = good_table();
  EXPECT_THAT(draw_timelines(table, {}), HasSubstr("Brightness"));
  for (FrameRecord& frame : table.frames) frame.picture = {}, frame.num_features.reset();
  const std::string html = draw_timelines(table, {});
  EXPECT_THAT(html, Not(HasSubstr("Brightness")));
  EXPECT_THAT(html, Not(HasSubstr("Features")));
}

TEST(Drawing, UpIsWhatWasUpForTheCamera) {
  std::vector<StampedPose> poses = circling_run().trajectories.front();
  auto views = choose_views(poses);
  EXPECT_EQ(views[0].right_name + views[0].up_name, "xz");
  EXPECT_EQ(views[1].up_name, "-y");
  // In a levelled world with z up the camera's y is -z.
  const Eigen::Quaterniond level(Eigen::AngleAxisd(-0.5 * M_PI, Eigen::Vector3d::UnitX()));
  for (StampedPose& pose : poses) {
    pose.world_from_camera.rotation = level;
    pose.world_from_camera.translation = level * pose.world_from_camera.translation;
  }
  views = choose_views(poses);
  EXPECT_EQ(views[0].right_name + views[0].up_name, "xy");
  EXPECT_EQ(views[1].up_name, "z");
  for (const ViewAxes& axes : views) EXPECT_NEAR(axes.right.dot(axes.up), 0.0, 1e-12);
}

TEST(Drawing, PointsFarOffDoNotShrinkThePath) {
  PathDrawing drawing;
  drawing.paths = {path_of(circling_run().trajectories.front(), Sim3(), "class=\"path0\"")};
  for (int i = 0; i < 100; ++i)
    drawing.points.emplace_back(1e6f + static_cast<float>(i), 0.0f, 0.0f);
  const std::string svg = draw_paths(drawing, ViewAxes{});
  EXPECT_THAT(svg, Not(HasSubstr("1e+06")));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Drawing, OfNothingIsASentence) {
  EXPECT_EQ(draw_paths({}, ViewAxes{}), "<p>There is no path to draw.</p>\n");
  EXPECT_EQ(draw_curve({}), "<p>There is nothing to draw.</p>\n");
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/evaluate_files.h"

#include <gmock/gmock.h>

#include <cmath>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/evaluate/report.h"
#include "waymark/report/testing/recorded_figures.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

std::vector<StampedPose> walk(double scale, std::int64_t later_ns = 0) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    poses.push_back(
        {std::int64_t{50'000'000} * i + 10'000'000'000 + later_ns,
         {Eigen::Quaterniond(Eigen::AngleAxisd(std::sin(0.9 * t), Eigen::Vector3d::UnitY())),
          scale * Eigen::Vector3d(t + 0.4 * std::sin(1.3 * t), std::sin(0.7 * t), 0.0)}});
  }
  return poses;
}

/// estimate.txt and truth.txt.
EvaluationRequest write_both(const TemporaryFolder& folder,
                             const std::vector<StampedPose>& estimate,
                             TrajectoryFormat format = TrajectoryFormat::kTum) {
  write_trajectory(folder / "estimate.txt", estimate, format);
  write_trajectory(folder / "truth.txt", walk(1.0), format);
  EvaluationRequest request;
  request.estimate = folder / "estimate.txt";
  request.groundtruth = folder / "truth.txt";
  return request;
}

TEST(EvaluateFiles, HasNothingToSayOfWhatFits) {
  const TemporaryFolder folder;
  const FileEvaluation result = evaluate_files(write_both(folder, walk(1.0)));
  EXPECT_LT(result.evaluation.ate_m.rmse, 1e-6);
  EXPECT_THAT(result.notes, IsEmpty());
}

TEST(EvaluateFiles, TellsOfAScaleThatIsFree) {
  const TemporaryFolder folder;
  EvaluationRequest request = write_both(folder, walk(0.25));
  const FileEvaluation result = evaluate_files(request);
  EXPECT_GT(result.evaluation.ate_m.rmse, 1.0);
  EXPECT_THAT(result.notes,
              ElementsAre(HasSubstr("the scale is off: 4 times as large the ATE is")));
  EXPECT_THAT(result.notes, ElementsAre(HasSubstr("--align sim3")));
}

TEST(EvaluateFiles, FollowsTheRunBesideTheEstimate) {
  const TemporaryFolder folder;
  EvaluationRequest request = write_both(folder, walk(0.25));
  RunSummary summary = good_summary(good_table());
  write_summary_json(folder.path(), summary);  // One camera.
  FileEvaluation result = evaluate_files(request);
  EXPECT_EQ(result.evaluation.alignment, TrajectoryAlignment::kSim3);
  EXPECT_LT(result.evaluation.ate_m.rmse, 1e-6);
  EXPECT_THAT(result.notes, ElementsAre(HasSubstr("aligned by sim3, as the run")));

  request.alignment = TrajectoryAlignment::kSe3;
  EXPECT_GT(evaluate_files(request).evaluation.ate_m.rmse, 1.0);

  request.alignment.reset();
  summary.quality->is_metric = true;
  write_summary_json(folder.path(), summary);
  EXPECT_EQ(evaluate_files(request).evaluation.alignment, TrajectoryAlignment::kSe3);

  folder.write("summary.json", "of something else");
  EXPECT_EQ(evaluate_files(request).evaluation.alignment, TrajectoryAlignment::kSe3);
}

TEST(EvaluateFiles, TellsOfClocksThatDiffer) {
  const TemporaryFolder folder;
  EvaluationRequest request = write_both(folder, walk(1.0, 1'000'000'000));
  FileEvaluation result = evaluate_files(request);
  EXPECT_GT(result.evaluation.ate_m.rmse, 0.1);
  EXPECT_THAT(result.notes,
              Contains(HasSubstr("the clocks seem to be 1 s apart, as the speeds agree with "
                                 "--time-offset -1: the ATE is")));
  request.finds_time_offset = true;
  result = evaluate_files(request);
  EXPECT_LT(result.evaluation.ate_m.rmse, 1e-6);
  EXPECT_THAT(result.notes, IsEmpty());
  EXPECT_THAT(format_evaluation(result.evaluation),
              HasSubstr("clocks     -1 s added to the times of the estimate"));
  request.finds_time_offset = false;
  request.time_offset_ns = -1'000'000'000;
  EXPECT_LT(evaluate_files(request).evaluation.ate_m.rmse, 1e-6);
}

TEST(EvaluateFiles, TellsOfClocksThatHaveNothingInCommon) {
  const TemporaryFolder folder;
  const EvaluationRequest request = write_both(folder, walk(1.0, 1'400'000'000'000'000'000));
  EXPECT_THAT(input_error_of([&] { evaluate_files(request); }),
              HasSubstr("hardly a pose has a true one near in time; the clocks seem to be "
                        "1400000000 s apart, as the speeds agree with --time-offset -1400000000"));
}

TEST(EvaluateFiles, ComparesPosesWithoutTimesLineByLine) {
  const TemporaryFolder folder;
  std::vector<StampedPose> estimate = walk(1.0);
  EvaluationRequest request = write_both(folder, estimate, TrajectoryFormat::kKitti);
  request.plot = folder / "plot.svg";
  const FileEvaluation result = evaluate_files(request);
  EXPECT_EQ(result.evaluation.num_pairs, 400u);
  EXPECT_LT(result.evaluation.ate_m.rmse, 1e-6);
  EXPECT_THAT(result.notes, ElementsAre(HasSubstr("compared line by line")));
  EXPECT_THAT(read_text_file(request.plot, "a plot"), HasSubstr(">line<"));
  request.finds_time_offset = true;
  EXPECT_THAT(input_error_of([&] { evaluate_files(request); }), HasSubstr("auto found no shift"));
  request.finds_time_offset = false;
  estimate.pop_back();
  write_trajectory(request.estimate, estimate, TrajectoryFormat::kKitti);
  EXPECT_THAT(input_error_of([&] { evaluate_files(request); }),
              HasSubstr("estimate.txt: 399 poses without times, expected 400 as in"));
}

}  // namespace
}  // namespace waymark

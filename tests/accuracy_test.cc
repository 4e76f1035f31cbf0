// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Images in, trajectory out, against the exact truth: each set-up on simulated images, and recorded
// sequences where WAYMARK_DATA has them.
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "recorded_run.h"
#include "simulated_run.h"

namespace waymark {
namespace {

// Where the bounds of simulated sequences come from, in metres. With the same camera and motion, 1
// px of noise and perfect associations, adjusting all frames at once leaves an error of 0.006
// (mono) or 0.007 (stereo): the least that any mapper has (see mapper_test.cc). The covariances
// that are announced add 0.009 (mono), 0.0024 (stereo) or 0.0027 (RGB-D) for what a single frame
// sees. Twice both together are 0.022 (mono) and 0.015 (the others).
TEST(Accuracy, Stereo) {
  const Recording recording = simulate(small_sequence(Setup::kStereo, 60));
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_EQ(coverage(results), 1.0);
  EXPECT_LT(evaluate_results(results, recording).ate_m.rmse, 0.01);
}

// 2 to 6 px of stereo parallax: hardly a range is known to a tenth. The path is 4.4 m long; the
// bound is half a percent of it.
TEST(Accuracy, StereoWithAShortBaseline) {
  SequenceSpec spec = small_sequence(Setup::kStereo, 60);
  spec.world = "hall";
  spec.chain.cameras[1].cam_from_rig.translation = {-0.11, 0.0, 0.0};
  const Recording recording = simulate(spec);
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_EQ(coverage(results), 1.0);
  EXPECT_LT(evaluate_results(results, recording).ate_m.rmse, 0.022);
}

TEST(Accuracy, Rgbd) {
  const Recording recording = simulate(small_sequence(Setup::kRgbd, 60));
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_EQ(coverage(results), 1.0);
  EXPECT_LT(evaluate_results(results, recording).ate_m.rmse, 0.01);
}

TEST(Accuracy, Mono) {
  const Recording recording = simulate(small_sequence(Setup::kMono, 60));
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_GE(coverage(results), 0.9);
  EXPECT_LT(evaluate_results(results, recording).ate_m.rmse, 0.02);
}

/// The gates of recorded sequences are those of the project's accuracy table, with the tolerance
/// that a single seed has there.
struct RecordedCase {
  const char* name;
  Setup setup;
  double min_coverage;
  double max_ate_m;
};

void PrintTo(const RecordedCase& recorded, std::ostream* stream) { *stream << recorded.name; }

class Recorded : public ::testing::TestWithParam<RecordedCase> {};

TEST_P(Recorded, IsAsAccurateAsStated) {
  const RecordedCase& expected = GetParam();
  const auto folder = recorded_sequence(expected.name);
  if (!folder) GTEST_SKIP() << "WAYMARK_DATA has no " << expected.name;
  const RecordedResults results = map_recorded(*folder, expected.setup, Timing::kLockstep);
  EXPECT_GE(coverage(results.session), expected.min_coverage);
  EXPECT_LT(results.evaluation.ate_m.rmse, 1.3 * expected.max_ate_m);
}

INSTANTIATE_TEST_SUITE_P(
    Sequences,
    Recorded,
    ::testing::Values(RecordedCase{"euroc_mh01_stereo", Setup::kStereo, 1.0, 0.0045},
                      RecordedCase{"euroc_mh01_stereo", Setup::kMono, 0.98, 0.0085},
                      RecordedCase{"kitti_00_stereo", Setup::kStereo, 1.0, 0.28},
                      RecordedCase{"tum_fr1_rpy_rgbd", Setup::kRgbd, 1.0, 0.026},
                      RecordedCase{"sim_warehouse_fisheye_stereo", Setup::kStereo, 1.0, 0.10},
                      RecordedCase{"sim_warehouse_fisheye_stereo", Setup::kMono, 0.98, 0.12},
                      RecordedCase{"sim_atrium_360", Setup::kMono, 0.98, 0.025}),
    [](const ::testing::TestParamInfo<RecordedCase>& info) {
      return std::string(info.param.name) + "_" + std::string(to_string(info.param.setup));
    });

}  // namespace
}  // namespace waymark

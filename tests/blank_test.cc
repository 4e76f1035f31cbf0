// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Among blank walls points on edges hold the pose where corners are in one place only.
#include <gtest/gtest.h>

#include "simulated_run.h"

namespace waymark {
namespace {

class Blank : public ::testing::TestWithParam<Setup> {
 protected:
  Blank() {
    SequenceSpec spec = small_sequence(GetParam(), 150);
    spec.world = "blank";
    recording_ = simulate(spec);
  }

  double error_m(bool has_edges) {
    recording_.settings.features.edges = has_edges;
    const SessionResults results = map_recording(recording_, Timing::kInline);
    EXPECT_EQ(coverage(results), 1.0);
    return evaluate_results(results, recording_).ate_m.rmse;
  }

  Recording recording_;
};

TEST_P(Blank, EdgesHoldThePose) { EXPECT_LT(error_m(true), 0.8 * error_m(false)); }

INSTANTIATE_TEST_SUITE_P(Setups, Blank, ::testing::Values(Setup::kStereo, Setup::kRgbd));

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Same input, same bits: threads do not change the answer.
#include <gtest/gtest.h>

#include "recorded_run.h"
#include "simulated_run.h"

namespace waymark {
namespace {

class Threads : public ::testing::TestWithParam<Setup> {};

TEST_P(Threads, DoNotChangeTheAnswer) {
  const Recording recording = simulate(small_sequence(GetParam(), 40));
  const std::uint64_t expected = hash_of(map_recording(recording, Timing::kInline));
  EXPECT_EQ(hash_of(map_recording(recording, Timing::kLockstep)), expected);
  EXPECT_EQ(hash_of(map_recording(recording, Timing::kLockstep)), expected);
}

INSTANTIATE_TEST_SUITE_P(Setups,
                         Threads,
                         ::testing::Values(Setup::kMono, Setup::kStereo, Setup::kRgbd),
                         [](const ::testing::TestParamInfo<Setup>& info) {
                           return std::string(to_string(info.param));
                         });

TEST(RecordedThreads, DoNotChangeTheAnswer) {
  const auto folder = recorded_sequence("euroc_mh01_stereo");
  if (!folder) GTEST_SKIP() << "WAYMARK_DATA has no euroc_mh01_stereo";
  const auto hash = [&](Timing timing) {
    return hash_of(map_recorded(*folder, Setup::kStereo, timing, 80).session);
  };
  const std::uint64_t expected = hash(Timing::kInline);
  EXPECT_EQ(hash(Timing::kLockstep), expected);
  EXPECT_EQ(hash(Timing::kLockstep), expected);
}

// The loop is closed some 70 frames before the end, so that the global adjustment beside the mapper
// is taken in before it, too.
TEST(RecordedThreads, DoNotChangeHowALoopIsClosed) {
  const auto folder = recorded_sequence("sim_house_rgbd");
  if (!folder) GTEST_SKIP() << "WAYMARK_DATA has no sim_house_rgbd";
  const SessionResults alone = map_recorded(*folder, Setup::kRgbd, Timing::kInline).session;
  EXPECT_GE(alone.summary.loops, 1u);
  EXPECT_EQ(hash_of(map_recorded(*folder, Setup::kRgbd, Timing::kLockstep).session),
            hash_of(alone));
}

TEST(Seed, IsHeard) {
  Recording recording = simulate(small_sequence(Setup::kMono, 40));
  const std::uint64_t first = hash_of(map_recording(recording, Timing::kInline));
  recording.settings.seed = 1;
  EXPECT_NE(hash_of(map_recording(recording, Timing::kInline)), first);
}

}  // namespace
}  // namespace waymark

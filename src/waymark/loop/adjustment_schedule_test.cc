// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/adjustment_schedule.h"

#include <gtest/gtest.h>

#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

class AdjustmentScheduleTest : public ::testing::Test {
 protected:
  AdjustmentScheduleTest()
      : scene_(cloud_all_round(200), true, Vector7d::Zero()),
        mapper_(scene_.rig, {}, {.refine = "off"}) {
    for (int step = 0; step < 4; ++step) scene_.add_keyframe(step);
    mapper_.take_over(*scene_.map.freeze());
  }

  LoopScene scene_;
  Mapper mapper_;
  AdjustmentSchedule schedule_;
};

TEST_F(AdjustmentScheduleTest, AClosureIsAdjustedOnce) {
  EXPECT_FALSE(schedule_.is_due(mapper_.map()));
  EXPECT_FALSE(schedule_.take(mapper_));
  schedule_.note_closure(SubmapId{0});
  EXPECT_TRUE(schedule_.is_due(mapper_.map()));
  const auto task = schedule_.take(mapper_);
  ASSERT_TRUE(task);
  EXPECT_EQ(task->submap, SubmapId{0});
  EXPECT_EQ(task->num_closures, 1u);
  EXPECT_FALSE(task->is_for_calibration);
  EXPECT_FALSE(schedule_.take(mapper_));
  EXPECT_TRUE(schedule_.confirm(*task, mapper_.map()));
}

TEST_F(AdjustmentScheduleTest, WhatWasMovedMeanwhileIsAdjustedAgain) {
  schedule_.note_closure(SubmapId{0});
  const auto task = schedule_.take(mapper_);
  schedule_.note_placement(SubmapId{0});
  schedule_.take(mapper_);  // Of the placement.
  EXPECT_FALSE(schedule_.is_due(mapper_.map()));
  EXPECT_FALSE(schedule_.confirm(*task, mapper_.map()));
  EXPECT_TRUE(schedule_.is_due(mapper_.map()));
}

}  // namespace
}  // namespace waymark

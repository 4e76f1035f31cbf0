// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/base/check.h"
#include "waymark/system/workers.h"

namespace waymark {
namespace {

AdjustmentTask empty_task() {
  Map map;
  const SubmapId submap = map.add_submap(true);
  return {map.freeze(), submap, 7};
}

class AdjustmentWorkerTest : public ::testing::TestWithParam<Timing> {};

TEST_P(AdjustmentWorkerTest, GivesEachTaskItsResult) {
  AdjustmentWorker worker(GetParam());
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(worker.is_busy());
    worker.start(empty_task());
    EXPECT_TRUE(worker.is_busy());
    EXPECT_THROW(worker.start(empty_task()), CheckError);
    const AdjustmentWorker::Result result = worker.finish();
    EXPECT_EQ(result.task.num_closures, 7u);
    EXPECT_TRUE(result.adjustment.landmarks.empty());
  }
  EXPECT_THROW(worker.finish(), CheckError);
}

TEST_P(AdjustmentWorkerTest, RethrowsWhatFailed) {
  AdjustmentWorker worker(GetParam());
  AdjustmentTask task = empty_task();
  task.submap = SubmapId{5};  // There is none.
  worker.start(task);
  EXPECT_ANY_THROW(worker.finish());
  worker.start(empty_task());
  EXPECT_NO_THROW(worker.finish());
}

TEST_P(AdjustmentWorkerTest, EndsWithATaskThatNobodyAskedFor) {
  AdjustmentWorker worker(GetParam());
  worker.start(empty_task());
}

INSTANTIATE_TEST_SUITE_P(Timings,
                         AdjustmentWorkerTest,
                         ::testing::Values(Timing::kInline, Timing::kLockstep),
                         [](const auto& info) {
                           return info.param == Timing::kInline ? "inline" : "lockstep";
                         });

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <stdexcept>

#include "waymark/system/workers.h"

namespace waymark {
namespace {

MapTask task_of(std::uint32_t frame) { return {FrameId{frame}, std::nullopt}; }

/// A map with as many sub-maps as there were tasks.
MapWorker::Work counting_work() {
  return [map = std::make_shared<Map>()](const MapTask&) {
    map->add_submap(true);
    auto published = std::make_shared<PublishedMap>();
    published->snapshot.map = map->freeze();
    return published;
  };
}

/// Fails at the task of a frame.
MapWorker::Work failing_work(std::uint32_t frame) {
  return [frame, count = counting_work()](const MapTask& task) {
    if (task.frame.value == frame) throw std::runtime_error("the mapper failed");
    return count(task);
  };
}

std::size_t num_submaps(const std::shared_ptr<const PublishedMap>& published) {
  return published ? published->snapshot.map->submaps().size() : 0;
}

class Worker : public ::testing::TestWithParam<Timing> {};

TEST_P(Worker, ShowsEachEffectFromItsFrameOn) {
  MapWorker worker(GetParam(), counting_work());
  EXPECT_EQ(worker.for_frame(FrameId{0}), nullptr);
  worker.send(FrameId{2}, task_of(0));
  EXPECT_EQ(num_submaps(worker.for_frame(FrameId{1})), 0u);
  worker.send(FrameId{3}, task_of(1));
  EXPECT_EQ(num_submaps(worker.for_frame(FrameId{2})), 1u);
  EXPECT_EQ(num_submaps(worker.for_frame(FrameId{7})), 2u);
}

TEST_P(Worker, ShowsEffectsInTheOrderOfTheTasks) {
  MapWorker worker(GetParam(), counting_work());
  worker.send(FrameId{5}, task_of(0));
  worker.send(FrameId{2}, task_of(1));  // Not before the one sent before it.
  EXPECT_EQ(num_submaps(worker.for_frame(FrameId{4})), 0u);
  EXPECT_EQ(num_submaps(worker.for_frame(FrameId{5})), 2u);
}

TEST_P(Worker, FinishesWhatWasSent) {
  int num_done = 0;
  MapWorker worker(GetParam(), [&](const MapTask&) {
    ++num_done;
    return std::make_shared<const PublishedMap>();
  });
  for (std::uint32_t i = 0; i < 50; ++i) worker.send(FrameId{i + 3}, task_of(i));
  worker.finish();
  EXPECT_EQ(num_done, 50);
}

INSTANTIATE_TEST_SUITE_P(Timings,
                         Worker,
                         ::testing::Values(Timing::kInline, Timing::kLockstep),
                         [](const auto& info) {
                           return info.param == Timing::kInline ? "inline" : "lockstep";
                         });

TEST(WorkerFailure, ReachesTheReaderThatWaits) {
  MapWorker worker(Timing::kLockstep, failing_work(1));
  worker.send(FrameId{2}, task_of(0));
  worker.send(FrameId{3}, task_of(1));
  EXPECT_THROW(worker.for_frame(FrameId{3}), std::runtime_error);
  EXPECT_THROW(worker.for_frame(FrameId{4}), std::runtime_error) << "it does not go away";
}

TEST(WorkerFailure, DoesNotBlockASenderWhoseMessagesNobodyTakes) {
  MapWorker worker(Timing::kLockstep, failing_work(0));
  for (std::uint32_t i = 0; i < 100; ++i) worker.send(FrameId{i + 3}, task_of(i));
  EXPECT_THROW(worker.finish(), std::runtime_error);
}

TEST(WorkerFailure, ReachesTheSenderWhenThereIsNoThread) {
  MapWorker worker(Timing::kInline, failing_work(0));
  EXPECT_THROW(worker.send(FrameId{3}, task_of(0)), std::runtime_error);
}

TEST(WorkerFailure, ThatNobodyAskedForEndsQuietly) {
  MapWorker worker(Timing::kLockstep, failing_work(0));
  worker.send(FrameId{3}, task_of(0));
}

}  // namespace
}  // namespace waymark

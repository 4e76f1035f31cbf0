// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/live_input.h"

#include <gmock/gmock.h>

#include <semaphore>

#include "waymark/session/testing/memory_input.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::MemoryInput;
using testing::read_all;
using testing::small_frames;

bool never() { return false; }

std::vector<std::size_t> indices_of(const std::vector<InputFrame>& frames) {
  std::vector<std::size_t> indices;
  for (const InputFrame& frame : frames) indices.push_back(frame.index);
  return indices;
}

TEST(PacedInput, WaitsNoLongerForAWrongTimeStamp) {
  std::vector<InputFrame> frames = small_frames(3);
  for (std::size_t i = 1; i < 3; ++i) {
    frames[i].timestamp_ns +=
        static_cast<std::int64_t>(i) * 4'000'000'000'000'000'000;  // 127 years.
  }
  MemoryInput input(frames);
  PacedInput paced(input, 1000.0, never, never);
  EXPECT_THAT(indices_of(read_all(paced)), ElementsAre(0, 1, 2));
}

TEST(LiveInput, GivesEveryFrameToWhoKeepsUp) {
  MemoryInput input(small_frames(20));
  std::counting_semaphore<> wanted(0);
  input.on_next = [&](std::size_t) { wanted.acquire(); };
  LiveInput live(input, never, never);
  for (std::size_t i = 0; i < 20; ++i) {
    wanted.release();
    const std::optional<InputFrame> frame = live.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, i);
    EXPECT_EQ(frame->fault, FrameFault::kNone);
    EXPECT_EQ(frame->images.size(), 1u);
  }
  wanted.release();
  EXPECT_FALSE(live.next());
}

TEST(LiveInput, DropsWhatNobodyHadTimeFor) {
  MemoryInput input(small_frames(9));
  std::binary_semaphore go_on(0);
  std::binary_semaphore is_read(0);
  input.on_next = [&](std::size_t index) {
    if (index == 1) go_on.acquire();
    if (index == 8) is_read.release();
    if (index == 8) go_on.acquire();
  };
  LiveInput live(input, never, never);
  ASSERT_TRUE(live.next());
  go_on.release();
  is_read.acquire();  // Frames 1 to 7 have come; two of them found room.
  std::vector<InputFrame> frames;
  for (int i = 0; i < 2; ++i) frames.push_back(*live.next());
  go_on.release();
  for (InputFrame& frame : read_all(live)) frames.push_back(std::move(frame));

  EXPECT_THAT(indices_of(frames), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  for (const InputFrame& frame : frames) {
    const bool is_late = frame.index >= 3 && frame.index <= 7;
    EXPECT_EQ(frame.fault, is_late ? FrameFault::kLate : FrameFault::kNone) << frame.index;
    EXPECT_EQ(frame.images.empty(), is_late);
    EXPECT_EQ(frame.jpeg.empty(), is_late);
  }
}

TEST(LiveInput, TellsOfWhatWasDroppedLast) {
  MemoryInput input(small_frames(6));
  std::binary_semaphore go_on(0);
  std::binary_semaphore is_read(0);
  input.on_next = [&](std::size_t index) {
    if (index == 1) go_on.acquire();
    if (index == 6) is_read.release();
  };
  LiveInput live(input, never, never);
  ASSERT_TRUE(live.next());
  go_on.release();
  is_read.acquire();
  const std::vector<InputFrame> frames = read_all(live);
  EXPECT_THAT(indices_of(frames), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_EQ(frames.back().fault, FrameFault::kLate);
}

TEST(LiveInput, PassesOnWhatTheInputThrows) {
  MemoryInput input(small_frames(6), 2);
  LiveInput live(input, never, never);
  EXPECT_EQ(live.next()->index, 0u);
  EXPECT_EQ(live.next()->index, 1u);
  EXPECT_THROW(live.next(), InputError);
  EXPECT_FALSE(live.next());
}

TEST(LiveInput, EndsBeforeItsInputDoes) {
  MemoryInput input(small_frames(1000));
  LiveInput live(input, never, never);
  EXPECT_TRUE(live.next());
}

TEST(LiveInput, LeavesOutFramesOfAPausedCameraOnly) {
  for (const bool is_live : {false, true}) {
    MemoryInput input(small_frames(5));
    input.info().is_live = is_live;
    LiveInput live(input, never, [] { return true; });
    EXPECT_EQ(read_all(live).size(), is_live ? 0u : 5u);
  }
}

TEST(PacedInput, DoesNotWaitOnceItShouldStop) {
  MemoryInput input(small_frames(5));  // 0.4 s at their own rate, 13 years at this one.
  PacedInput paced(
      input, 1e-9, [] { return true; }, never);
  EXPECT_EQ(read_all(paced).size(), 5u);
}

TEST(PacedInput, GivesFramesNoSoonerThanTheirTimes) {
  MemoryInput input(small_frames(3));
  PacedInput paced(input, 10.0, never, never);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(read_all(paced).size(), 3u);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(20));
}

TEST(TimedInput, IsTheInputItselfWithoutAPaceOfItsOwn) {
  MemoryInput input(small_frames(3));
  EXPECT_EQ(&TimedInput(input, 0.0, true, never, never).get(), &input);
  EXPECT_NE(&TimedInput(input, 1.0, false, never, never).get(), &input);
  input.info().is_live = true;
  EXPECT_EQ(&TimedInput(input, 0.0, false, never, never).get(), &input);
  EXPECT_NE(&TimedInput(input, 0.0, true, never, never).get(), &input);
}

}  // namespace
}  // namespace waymark

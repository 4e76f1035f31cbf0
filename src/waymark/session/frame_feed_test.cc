// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/frame_feed.h"

#include <gmock/gmock.h>

#include "waymark/session/testing/memory_input.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::MemoryInput;
using testing::small_frames;

/// Says that it tracked each frame, in a sub-map of the number `submap`.
auto track_in(std::uint32_t submap, std::uint32_t& num_fed) {
  return [submap, &num_fed](const auto&) {
    TrackingResult result;
    result.frame = FrameId{num_fed++};
    result.state = FrameState::kTracked;
    result.submap = SubmapId{submap};
    return result;
  };
}

TEST(FeedAll, GivesEachFrameARowButFeedsTheSoundOnes) {
  std::vector<InputFrame> frames = small_frames(5);
  frames[1].fault = FrameFault::kUnreadable;
  frames[2].fault = FrameFault::kWrongSize;
  frames[4].fault = FrameFault::kLate;
  for (const int i : {1, 2, 4}) frames[i].images.clear();
  MemoryInput input(std::move(frames));
  std::uint32_t num_fed = 0;
  std::vector<FrameReason> observed;
  const FedFrames fed =
      feed_all(input, track_in(0, num_fed), nullptr, [&](const auto& row, const auto&) {
        observed.push_back(row.reason);
      });
  EXPECT_EQ(num_fed, 2u);
  EXPECT_THAT(fed.fed, ElementsAre(0, 3));
  EXPECT_EQ(fed.tracking_ms.size(), 2u);
  std::vector<FrameState> states;
  for (const auto& row : fed.table.frames) states.push_back(row.state);
  EXPECT_THAT(states,
              ElementsAre(FrameState::kTracked,
                          FrameState::kUnreadable,
                          FrameState::kUnreadable,
                          FrameState::kTracked,
                          FrameState::kDropped));
  EXPECT_THAT(observed,
              ElementsAre(FrameReason::kNone,
                          FrameReason::kUnreadableImage,
                          FrameReason::kWrongSize,
                          FrameReason::kNone,
                          FrameReason::kLate));
}

TEST(FeedAll, StopsWhenItShould) {
  MemoryInput input(small_frames(9));
  std::uint32_t num_fed = 0;
  feed_all(
      input, track_in(0, num_fed), [&] { return num_fed == 4; }, nullptr);
  EXPECT_EQ(num_fed, 4u);
  EXPECT_EQ(input.next()->index, 4u);
}

TEST(FeedAll, ForgetsWhichMapFramesOfBeforeAResetWereIn) {
  MemoryInput input(small_frames(6));
  std::uint32_t num_fed = 0;
  std::uint32_t num_calls = 0;
  const FedFrames fed = feed_all(
      input,
      [&](const auto& frame) {
        if (++num_calls == 5) num_fed = 0;
        return track_in(0, num_fed)(frame);
      },
      nullptr,
      nullptr);
  EXPECT_THAT(fed.fed, ElementsAre(4, 5));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(fed.table.frames[i].submap.is_valid(), i >= 4) << i;
    EXPECT_EQ(fed.table.frames[i].state, FrameState::kTracked);
  }
}

TEST(SplitBySubmap, PutsTheLongestFirstAndTheOlderWhereTheyTie) {
  const auto parts = split_by_submap({{SubmapId{3}, {1, {}}},
                                      {SubmapId{1}, {2, {}}},
                                      {SubmapId{2}, {3, {}}},
                                      {SubmapId{2}, {4, {}}}});
  std::vector<std::uint32_t> submaps;
  for (const auto& [submap, poses] : parts) submaps.push_back(submap.value);
  EXPECT_THAT(submaps, ElementsAre(2, 1, 3));
  EXPECT_EQ(parts[0].second.size(), 2u);
}

}  // namespace
}  // namespace waymark

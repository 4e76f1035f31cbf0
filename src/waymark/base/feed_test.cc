// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/feed.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <thread>
#include <vector>

#include "waymark/base/mailbox.h"

namespace waymark {
namespace {

std::shared_ptr<const int> value(int v) { return std::make_shared<const int>(v); }

TEST(Feed, ShowsValuesFromTheirFrameOn) {
  for (const Timing timing : {Timing::kInline, Timing::kLockstep}) {
    Feed<int> feed(timing);
    EXPECT_EQ(feed.for_frame(FrameId{0}), nullptr);
    feed.expect(FrameId{5});
    feed.publish(FrameId{5}, value(10));
    EXPECT_EQ(feed.for_frame(FrameId{4}), nullptr);
    EXPECT_EQ(*feed.for_frame(FrameId{5}), 10);
    feed.publish(FrameId{6}, value(20));
    feed.publish(FrameId{7}, value(30));
    feed.publish(FrameId{9}, value(50));
    EXPECT_EQ(*feed.for_frame(FrameId{8}), 30);
    EXPECT_EQ(*feed.for_frame(FrameId{9}), 50);
  }
}

TEST(Feed, RealtimeShowsTheNewestAtOnceAndNeverWaits) {
  Feed<int> feed(Timing::kRealtime, value(0));
  feed.expect(FrameId{0});
  EXPECT_EQ(*feed.for_frame(FrameId{100}), 0);
  feed.publish(FrameId{1}, value(1));
  feed.publish(FrameId{2}, value(2));
  EXPECT_EQ(*feed.for_frame(FrameId{101}), 2);
}

// The initial value must not pass for what the first frame caused.
TEST(Feed, InitialValueAnswersNoExpectation) {
  Feed<int> feed(Timing::kInline, value(-1));
  EXPECT_EQ(*feed.for_frame(FrameId{0}), -1);
  feed.expect(FrameId{0});
  EXPECT_THROW(feed.for_frame(FrameId{0}), CheckError);
}

TEST(Feed, SeveralValuesMayShowFromOneFrameOn) {
  Feed<int> feed(Timing::kLockstep);
  feed.expect(FrameId{1});
  feed.expect(FrameId{1});
  feed.publish(FrameId{1}, value(1));
  std::jthread writer([&] { feed.publish(FrameId{1}, value(2)); });
  EXPECT_EQ(*feed.for_frame(FrameId{2}), 2) << "waits for both";
}

TEST(Feed, FramesNeverDescend) {
  Feed<int> feed(Timing::kLockstep);
  feed.expect(FrameId{2});
  EXPECT_THROW(feed.expect(FrameId{1}), CheckError);
  feed.publish(FrameId{2}, value(2));
  EXPECT_THROW(feed.publish(FrameId{1}, value(1)), CheckError);
}

TEST(Feed, FailureReachesTheWaitingReader) {
  Feed<int> feed(Timing::kLockstep);
  feed.expect(FrameId{0});
  std::jthread writer([&] {
    feed.fail(std::make_exception_ptr(std::runtime_error("first")));
    feed.fail(std::make_exception_ptr(std::logic_error("second")));
  });
  EXPECT_THROW(feed.for_frame(FrameId{1}), std::runtime_error);
  EXPECT_THROW(feed.for_frame(FrameId{2}), std::runtime_error);
}

TEST(Feed, ClosingFreesTheWaitingReader) {
  Feed<int> feed(Timing::kLockstep, value(-1));
  feed.expect(FrameId{0});
  feed.expect(FrameId{1});
  std::jthread writer([&] {
    feed.publish(FrameId{0}, value(0));
    feed.close();
  });
  EXPECT_EQ(*feed.for_frame(FrameId{5}), 0);
}

/// What a reader sees over 400 frames of which every third sends work to the writer, the result of
/// which is visible four frames later.
std::vector<int> seen_over_frames(Timing timing) {
  Feed<std::vector<int>> feed(timing);
  Mailbox<FrameId> inbox(8);
  std::vector<int> state;  // Of the writer.
  const auto map_one = [&](FrameId frame) {
    state.push_back(static_cast<int>(frame.value));
    feed.publish(FrameId{frame.value + 4}, std::make_shared<const std::vector<int>>(state));
  };
  std::jthread writer;
  if (timing != Timing::kInline) {
    writer = std::jthread([&] {
      while (const std::optional<FrameId> frame = inbox.pop()) map_one(*frame);
      feed.close();
    });
  }
  std::vector<int> seen;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const auto visible = feed.for_frame(FrameId{i});
    int sum = 0;  // Reads all of it, so that the thread sanitizer sees a race if there is one.
    if (visible)
      for (const int v : *visible) sum += v;
    seen.push_back(sum);
    if (i % 3 != 0) continue;
    feed.expect(FrameId{i + 4});
    timing == Timing::kInline ? map_one(FrameId{i}) : static_cast<void>(inbox.push(FrameId{i}));
  }
  inbox.close();
  return seen;
}

TEST(Feed, ThreadsDoNotChangeWhatIsSeen) {
  const std::vector<int> expected = seen_over_frames(Timing::kInline);
  EXPECT_EQ(expected[3], 0);
  EXPECT_EQ(expected[7], 3);
  for (int round = 0; round < 5; ++round) {
    EXPECT_EQ(seen_over_frames(Timing::kLockstep), expected);
  }
  const std::vector<int> realtime = seen_over_frames(Timing::kRealtime);
  EXPECT_TRUE(std::is_sorted(realtime.begin(), realtime.end()));
}

}  // namespace
}  // namespace waymark

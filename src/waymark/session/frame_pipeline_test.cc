// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/frame_pipeline.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/session/testing/memory_input.h"

namespace waymark {
namespace {

using testing::MemoryInput;
using testing::read_all;
using testing::small_frames;

/// Lets other threads decode.
class DecodedApart : public MemoryInput {
 public:
  using MemoryInput::MemoryInput;
  bool can_decode_apart() const override { return true; }
};

/// Decodes beside being read: even frames wait until the odd one after them is done.
class TwistedInput : public DecodedApart {
 public:
  using DecodedApart::DecodedApart;

  std::optional<Decoding> next_decoding() override {
    std::optional<InputFrame> frame = next();
    if (!frame) return std::nullopt;
    if (frame->index % 2 == 0) gate_ = std::make_shared<Mailbox<bool>>(1);
    const auto decoded = std::make_shared<InputFrame>(*std::move(frame));
    return [decoded, gate = gate_] {
      if (decoded->index % 2 == 0) {
        gate->pop();
      } else {
        gate->push(true);
      }
      return *decoded;
    };
  }

  void complete(InputFrame& frame) override { completed.push_back(frame.index); }

  std::vector<std::size_t> completed;

 private:
  std::shared_ptr<Mailbox<bool>> gate_;
};

EarlyStages stages_of(std::size_t num_prepared, unsigned num_decoders) {
  return {num_prepared, num_decoders, nullptr, [](const auto&, const auto&) {}};
}

/// The index of the next frame; nothing at the end.
std::optional<std::size_t> feed_next(FramePipeline& pipeline) {
  std::size_t index = 0;
  const auto feed = [&](const InputFrame& frame, const auto&) { index = frame.index; };
  return pipeline.feed_next(feed) ? std::optional(index) : std::nullopt;
}

TEST(FramePipeline, KeepsTheOrderWhateverIsDecodedFirst) {
  TwistedInput input(small_frames(40));
  FramePipeline pipeline(input, stages_of(1, 2));
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(feed_next(pipeline), i);
    EXPECT_EQ(input.completed.back(), std::min<std::size_t>(i + 1, 39))
        << "in the thread that asks, not before";
  }
  EXPECT_FALSE(feed_next(pipeline));
}

TEST(FramePipeline, PreparesTheImagesThatItFeeds) {
  std::vector<InputFrame> frames = small_frames(6);
  frames[2].fault = FrameFault::kUnreadable;
  frames[2].images.clear();
  MemoryInput input(std::move(frames));
  std::vector<std::size_t> decoded;
  std::vector<const std::uint8_t*> prepared, fed;
  EarlyStages stages;
  stages.num_prepared = 3;
  stages.on_decoded = [&](InputFrame& frame) { decoded.push_back(frame.index); };
  stages.prepare = [&](const FrameImages& images, const auto& owner) {
    EXPECT_TRUE(owner);
    prepared.push_back(images.image0.data);
  };
  FramePipeline pipeline(input, stages);
  const auto feed = [&](const InputFrame& frame, const FrameImages& images) {
    EXPECT_EQ(images.image0.is_empty(), frame.index == 2);
    EXPECT_EQ(decoded.size(), std::min<std::size_t>(frame.index + 4, 6));
    if (frame.index != 2) fed.push_back(images.image0.data);
  };
  while (pipeline.feed_next(feed)) {
  }
  EXPECT_EQ(fed.size(), 5u);
  EXPECT_EQ(prepared, fed);
}

TEST(FramePipeline, PassesOnWhatTheInputThrowsAfterTheFramesBefore) {
  DecodedApart input(small_frames(9), 5);
  FramePipeline pipeline(input, stages_of(2, 3));
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(feed_next(pipeline), i);
  EXPECT_THROW(feed_next(pipeline), InputError);
}

TEST(FramePipeline, EndsBeforeItsInputDoesAndReadsOnlySomeFramesBeforeTheirTurn) {
  DecodedApart input(small_frames(1000));
  {
    FramePipeline pipeline(input, stages_of(2, 2));
    EXPECT_EQ(feed_next(pipeline), 0u);
  }
  EXPECT_GT(read_all(input).size(), 980u);
}

}  // namespace
}  // namespace waymark

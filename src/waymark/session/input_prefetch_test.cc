// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/input_prefetch.h"

#include <gmock/gmock.h>

#include <memory>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/session/testing/memory_input.h"

namespace waymark {
namespace {

using testing::MemoryInput;
using testing::read_all;
using testing::small_frames;

/// Decodes beside being read: even frames wait until the odd one after them is done.
class TwistedInput : public MemoryInput {
 public:
  using MemoryInput::MemoryInput;

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

TEST(InputPrefetch, KeepsTheOrderWhateverIsDecodedFirst) {
  TwistedInput input(small_frames(40));
  InputPrefetch ahead(input, 2);
  EXPECT_EQ(ahead.info().num_frames, 40u);
  for (std::size_t i = 0; i < 40; ++i) {
    const std::optional<InputFrame> frame = ahead.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, i);
    EXPECT_EQ(frame->images.size(), 1u);
    EXPECT_EQ(input.completed.back(), i) << "in the thread that asks, not before";
  }
  EXPECT_FALSE(ahead.next());
}

TEST(InputPrefetch, PassesOnWhatTheInputThrowsAfterTheFramesBefore) {
  MemoryInput input(small_frames(9), 5);
  InputPrefetch ahead(input, 3);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(ahead.next()->index, i);
  EXPECT_THROW(ahead.next(), InputError);
  EXPECT_FALSE(ahead.next());
}

TEST(InputPrefetch, EndsBeforeItsInputDoesAndReadsOnlySomeAhead) {
  MemoryInput input(small_frames(1000));
  {
    InputPrefetch ahead(input, 2);
    EXPECT_EQ(ahead.next()->index, 0u);
  }
  const std::vector<InputFrame> rest = read_all(input);
  EXPECT_GT(rest.size(), 980u);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/hub.h"

#include <gtest/gtest.h>

#include "waymark/view/test_messages.h"

namespace waymark {
namespace {

/// Has everything sent at once.
class Reader : public ViewClient {
 public:
  void send() override {
    while (const auto outgoing = outbox.take()) {
      if (!outgoing->is_text) messages.push_back(outgoing->message);
    }
  }
  void close() override {}

  std::size_t count(MessageKind kind) const {
    std::size_t num_found = 0;
    for (const Message& message : messages)
      num_found += MessageReader(*message).kind == static_cast<std::uint8_t>(kind);
    return num_found;
  }

  std::vector<Message> messages;
};

ViewUpdate frame_update(std::uint32_t frame) {
  DrawnFrame image;
  image.frame = FrameId{frame};
  image.width_px = 8;
  image.height_px = 6;
  image.features = std::make_shared<Features>();
  image.image = Image(8, 6);
  ViewUpdate update;
  update.image = std::make_shared<const DrawnFrame>(std::move(image));
  return update;
}

class Hub : public ::testing::Test {
 protected:
  void push(ViewUpdate update) { ASSERT_TRUE(channel_.updates.try_push(update)); }
  void tick() { hub_.tick(now_ += std::chrono::milliseconds(100)); }
  std::shared_ptr<Reader> join() {
    auto reader = std::make_shared<Reader>();
    hub_.add(reader);
    return reader;
  }

  ViewChannel channel_;
  ViewHub hub_{channel_, {}};
  ViewHub::Clock::time_point now_ = ViewHub::Clock::now();
};

TEST_F(Hub, WhoComesWhileNothingMovesSeesTheLastFrame) {
  tick();
  EXPECT_TRUE(channel_.wants_image);
  push(frame_update(7));
  tick();
  const auto late = join();
  tick();
  EXPECT_EQ(late->count(MessageKind::kBegin), 1u);
  EXPECT_EQ(late->count(MessageKind::kFrame), 1u);
  tick();
  EXPECT_EQ(late->count(MessageKind::kFrame), 1u);
}

TEST_F(Hub, AResetForgetsTheLastFrame) {
  push(frame_update(7));
  tick();
  ViewUpdate reset;
  reset.is_reset = true;
  push(std::move(reset));
  tick();
  const auto late = join();
  tick();
  EXPECT_EQ(late->count(MessageKind::kFrame), 0u);
}

TEST_F(Hub, EveryFrameIsToldOnceToThoseWhoWantIt) {
  const auto reader = join(), other = join();
  other->max_rate_hz = 0.0;
  tick();
  for (std::uint32_t frame = 0; frame < 3; ++frame) {
    push(frame_update(frame));
    tick();
    tick();
  }
  EXPECT_EQ(reader->count(MessageKind::kFrame), 3u);
  EXPECT_EQ(other->count(MessageKind::kFrame), 0u);
}

}  // namespace
}  // namespace waymark

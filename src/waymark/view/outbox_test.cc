// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "waymark/view/hub.h"

namespace waymark {
namespace {

Message message(const std::string& text) { return std::make_shared<const std::string>(text); }

std::vector<std::string> take_all(Outbox& outbox) {
  std::vector<std::string> taken;
  while (const auto outgoing = outbox.take()) taken.push_back(*outgoing->message);
  return taken;
}

TEST(Outbox, SendsTheSceneBeforeWhatTellsOfIt) {
  Outbox outbox;
  const std::vector<Message> snapshot = {message("a"), message("b")};
  outbox.add_snapshot(snapshot);
  outbox.set_frame(message("old frame"));
  outbox.set_frame(message("frame"));
  outbox.set_status(message("status"));
  outbox.add(message("c"));
  outbox.add_answer(message("answer"));
  EXPECT_THAT(take_all(outbox), ::testing::ElementsAre("answer", "a", "b", "c", "status", "frame"));
  EXPECT_TRUE(outbox.is_empty());
}

TEST(Outbox, NothingIsToldBeforeTheFirstSnapshot) {
  Outbox outbox;
  EXPECT_TRUE(outbox.is_behind());
  outbox.add(message("difference"));
  EXPECT_TRUE(outbox.is_empty());
}

TEST(Outbox, WhoReadsTooSlowlyGetsEverythingAnew) {
  Outbox outbox(100);
  const std::vector<Message> snapshot = {message(std::string(1000, 'x'))};
  outbox.add_snapshot(snapshot);
  EXPECT_FALSE(outbox.is_behind());
  for (int i = 0; i < 10; ++i) outbox.add(message(std::string(10, 'y')));
  EXPECT_FALSE(outbox.is_behind());
  outbox.add(message("z"));
  EXPECT_TRUE(outbox.is_behind());
  EXPECT_TRUE(outbox.is_empty());
  outbox.add(message("lost"));
  EXPECT_TRUE(outbox.is_empty());
  outbox.add_snapshot(snapshot);
  EXPECT_FALSE(outbox.is_behind());
}

TEST(Outbox, WhoReadsGetsRoomBack) {
  Outbox outbox(100);
  outbox.add_snapshot({});
  for (int i = 0; i < 100; ++i) {
    outbox.add(message(std::string(60, 'y')));
    EXPECT_TRUE(outbox.take().has_value());
  }
  EXPECT_FALSE(outbox.is_behind());
}

TEST(Outbox, AnswersAreBounded) {
  Outbox outbox(100);
  EXPECT_TRUE(outbox.add_answer(message(std::string(90, 'a'))));
  EXPECT_FALSE(outbox.add_answer(message(std::string(90, 'a'))));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "waymark/map/testing/random_map.h"
#include "waymark/view/hub.h"
#include "waymark/view/testing/hub_clients.h"
#include "waymark/view/testing/messages.h"

namespace waymark {
namespace {

constexpr const char* kJpeg = "\xff\xd8 an image";

/// A hub of a saved map whose first keyframe has an image; scaled maps may be written.
class SavedMapHub : public ::testing::Test {
 protected:
  SavedMapHub() {
    ViewUpdate update;
    update.map = random_.map().freeze();
    update.map->keyframes().for_each([&](KeyframeId id, const Keyframe&) {
      if (!first_.is_valid()) first_ = id;
      last_ = id;
    });
    update.keyframe_images[first_] = std::make_shared<const std::string>(kJpeg);
    channel_.updates.try_push(update);
    number_ = hub_.add(reader_);
    hub_.tick(now_);
  }
  void ask(const std::string& request) { hub_.receive(number_, request, now_); }
  void ask_for_image(KeyframeId id) {
    ask(R"({"request": 8589934598, "do": "image", "id": )" + std::to_string(id.value) + "}");
  }

  testing::RandomMap random_{3};
  KeyframeId first_;
  KeyframeId last_;
  ViewChannel channel_;
  ViewHub hub_{channel_, [] {
                 SessionInfo info;
                 info.is_live = false;
                 info.can_scale = true;
                 info.keeps_images = true;
                 return info;
               }()};
  std::shared_ptr<Reader> reader_ = std::make_shared<Reader>();
  std::uint64_t number_ = 0;
  ViewHub::Clock::time_point now_ = ViewHub::Clock::now();
};

TEST_F(SavedMapHub, ShowsTheImageOfAKeyframeWithItsFeatures) {
  EXPECT_EQ(reader_->of_type("hello")[0]["keyframe_images"], true);
  ask_for_image(first_);
  ASSERT_EQ(reader_->count(MessageKind::kKeyframeImage), 1u);
  MessageReader message(*reader_->messages.back());
  EXPECT_EQ(message.take_all<std::uint32_t>(3), std::vector<std::uint32_t>({6, 2, first_.value}));
  EXPECT_TRUE(reader_->messages.back()->ends_with(kJpeg));
  ask_for_image(last_);
  EXPECT_EQ(reader_->of_type("reply").back()["error"], "its image was not kept");
  ask_for_image(KeyframeId{1'000'000});
  EXPECT_EQ(reader_->of_type("reply").back()["error"], "no such keyframe");
}

TEST_F(SavedMapHub, HoldsNoMoreImagesThanAClientReads) {
  const auto sleeper = std::make_shared<Sleeper>();
  const std::uint64_t number = hub_.add(sleeper);
  ViewUpdate update;
  update.keyframe_images[first_] = std::make_shared<const std::string>(std::size_t{3} << 20, 'x');
  channel_.updates.try_push(update);
  hub_.tick(now_);
  for (int i = 0; i < 40; ++i) {
    hub_.receive(number,
                 R"({"request": 1, "do": "image", "id": )" + std::to_string(first_.value) + "}",
                 now_);
  }
  EXPECT_FALSE(sleeper->is_closed);
  std::size_t num_bytes = 0;
  while (const auto outgoing = sleeper->outbox.take()) num_bytes += outgoing->message->size();
  EXPECT_LT(num_bytes, std::size_t{20} << 20);
}

TEST_F(SavedMapHub, PassesOnADistanceToScaleBy) {
  EXPECT_EQ(reader_->of_type("hello")[0]["controls"], json({"scale"}));
  ask(R"({"request": 4, "do": "scale", "a": {"keyframe": 1}, "b": {"landmark": 2}, "metres": 3})");
  EXPECT_TRUE(reader_->of_type("reply").empty());
  const std::optional<ViewRequest> request = channel_.requests.try_pop();
  ASSERT_TRUE(request && request->distance);
  EXPECT_EQ(request->kind, ViewRequest::Kind::kScale);
  EXPECT_EQ(request->distance->metres, 3.0);
  ViewReply written{*request, "scaled.wmap", ""};
  ASSERT_TRUE(channel_.replies.try_push(written));
  hub_.tick(now_);
  EXPECT_EQ(reader_->of_type("reply").back()["path"], "scaled.wmap");
  EXPECT_EQ(reader_->of_type("reply").back()["request"], 4);
}

TEST(LiveHub, AsksTheSessionForImagesOnlyWhereItKeepsThem) {
  ViewChannel channel;
  const auto now = ViewHub::Clock::now();
  ViewHub without(channel, {});
  const auto reader = std::make_shared<Reader>();
  const std::uint64_t number = without.add(reader);
  without.receive(number, R"({"request": 1, "do": "image", "id": 0})", now);
  EXPECT_EQ(reader->of_type("reply").back()["ok"], false);
  without.receive(
      number,
      R"({"request": 1, "do": "scale", "a": {"keyframe": 1}, "b": {"keyframe": 2}, "metres": 3})",
      now);
  EXPECT_EQ(reader->of_type("reply").back()["ok"], false);
  EXPECT_FALSE(channel.requests.try_pop());
  SessionInfo info;
  info.keeps_images = true;
  ViewHub hub(channel, info);
  const auto other = std::make_shared<Reader>();
  testing::RandomMap random(3);
  ViewUpdate update;
  update.map = random.map().freeze();
  ASSERT_TRUE(channel.updates.try_push(update));
  const std::uint64_t of_other = hub.add(other);
  hub.tick(now);
  hub.receive(of_other, R"({"request": 7, "do": "image", "id": 0})", now);
  const std::optional<ViewRequest> request = channel.requests.try_pop();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->kind, ViewRequest::Kind::kImage);
  EXPECT_EQ(request->keyframe, KeyframeId{0});
  ViewReply shown{*request, "", "", std::make_shared<const std::string>(kJpeg)};
  ASSERT_TRUE(channel.replies.try_push(shown));
  hub.tick(now);
  EXPECT_EQ(other->count(MessageKind::kKeyframeImage), 1u);
}

}  // namespace
}  // namespace waymark

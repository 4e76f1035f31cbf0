// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/hub.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "waymark/map/testing/random_map.h"
#include "waymark/view/testing/hub_clients.h"
#include "waymark/view/testing/messages.h"

namespace waymark {
namespace {

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

  /// A new client and its number.
  std::pair<std::uint64_t, std::shared_ptr<Reader>> join_as() {
    auto reader = std::make_shared<Reader>();
    const std::uint64_t number = hub_.add(reader);
    return {number, reader};
  }
  json ask(std::uint64_t number, const Reader& reader, const std::string& request) {
    hub_.receive(number, request, now_);
    const std::vector<json> replies = reader.of_type("reply");
    return replies.empty() ? json() : replies.back();
  }

  ViewChannel channel_;
  SessionInfo info_ = [] {
    SessionInfo info;
    info.can_save = true;
    return info;
  }();
  ViewHub hub_{channel_, info_};
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

TEST_F(Hub, GreetsAndThenTellsTheStatusWhenItChanges) {
  const auto reader = join();
  ASSERT_EQ(reader->of_type("hello").size(), 1u);
  ASSERT_EQ(reader->of_type("status").size(), 1u);
  ViewUpdate update = frame_update(1);
  update.status.phase = SessionPhase::kRunning;
  update.status.num_frames = 17;
  push(std::move(update));
  tick();
  const json status = reader->of_type("status").back();
  EXPECT_EQ(status["phase"], "running");
  EXPECT_EQ(status["frames"], 17);
  EXPECT_EQ(status["clients"], 1);
  EXPECT_EQ(json::parse(hub_.status()), status);
}

TEST_F(Hub, ASessionWithAnImuTellsTheVelocity) {
  const auto reader = join();
  Map map;
  const SubmapId submap = map.add_submap(true);
  ViewUpdate update;
  update.map = map.freeze();
  update.status.imu.emplace();
  for (std::uint32_t i = 0; i < 2; ++i) {
    const Rigid3 pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.5 * i));
    update.frames.push_back(
        {{.submap = submap}, FrameId{i}, 250'000'000 * std::int64_t{i}, 0.0f, {}, pose});
  }
  push(std::move(update));
  tick();
  EXPECT_EQ(reader->of_type("status").back()["imu"]["velocity_m_s"], json({0.0, 0.0, 2.0}));
}

/// While the input is opened and its calibration found: what is done, and who may be asked for
/// what.
TEST_F(Hub, TellsWhatIsDoneBeforeThereIsASession) {
  const auto [number, reader] = join_as();
  ViewUpdate before;
  before.status.doing = "calibration: round 1";
  push(std::move(before));
  tick();
  EXPECT_EQ(reader->of_type("status").back()["doing"], "calibration: round 1");
  const json refused = ask(number, *reader, R"({"request": 1, "do": "pause"})");
  EXPECT_EQ(refused["error"], "there is no session yet: calibration: round 1");
  EXPECT_EQ(ask(number, *reader, R"({"request": 2, "do": "stop"})")["ok"], true);
  ViewUpdate begun, reset;
  begun.info.emplace(info_).setup = "stereo";
  reset.is_reset = true;  // What was told of the session stays.
  push(std::move(begun));
  push(std::move(reset));
  tick();
  EXPECT_EQ(reader->of_type("status").back()["doing"], "");
  ASSERT_EQ(reader->of_type("hello").size(), 2u);
  EXPECT_EQ(reader->of_type("hello").back()["setup"], "stereo");
  EXPECT_EQ(join()->of_type("hello").front()["setup"], "stereo");
  EXPECT_EQ(ask(number, *reader, R"({"request": 3, "do": "pause"})")["ok"], true);
}

TEST_F(Hub, TellsTheStatusOnceASecondWhereNothingHappens) {
  tick();
  const auto reader = join();
  tick();  // With the snapshot.
  const std::size_t before = reader->of_type("status").size();
  for (int i = 0; i < 8; ++i) tick();
  EXPECT_EQ(reader->of_type("status").size(), before);
  for (int i = 0; i < 22; ++i) tick();
  EXPECT_EQ(reader->of_type("status").size(), before + 3);
}

TEST_F(Hub, PassesRequestsOnAndAnswersThem) {
  const auto [number, reader] = join_as();
  EXPECT_EQ(ask(number, *reader, R"({"request": 4, "do": "pause"})")["ok"], true);
  const std::optional<ViewRequest> pause = channel_.requests.try_pop();
  ASSERT_TRUE(pause);
  EXPECT_EQ(pause->kind, ViewRequest::Kind::kPause);
  EXPECT_EQ(pause->client, number);
  EXPECT_EQ(pause->number, 4u);
  const json reply = ask(number, *reader, R"({"request": 5, "do": "fly"})");
  EXPECT_EQ(reply["ok"], false);
  EXPECT_EQ(reply["request"], 5);
  EXPECT_FALSE(channel_.requests.try_pop());
}

TEST_F(Hub, SavingIsAnsweredOnceItIsDone) {
  const auto [number, reader] = join_as();
  const auto other = join();
  EXPECT_EQ(ask(number, *reader, R"({"request": 6, "do": "save"})"), json());
  const std::optional<ViewRequest> save = channel_.requests.try_pop();
  ASSERT_TRUE(save);
  ViewReply done{*save, "room.wmap", ""};
  ASSERT_TRUE(channel_.replies.try_push(done));
  ViewReply failed{*save, "", "the disk is full"};
  ASSERT_TRUE(channel_.replies.try_push(failed));
  ViewReply nobody{{ViewRequest::Kind::kSave, number + 100, 1}, "", ""};
  ASSERT_TRUE(channel_.replies.try_push(nobody));
  tick();
  const std::vector<json> replies = reader->of_type("reply");
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_EQ(replies[0]["path"], "room.wmap");
  EXPECT_EQ(replies[1]["error"], "the disk is full");
  EXPECT_TRUE(other->of_type("reply").empty());
}

TEST_F(Hub, ShowsElementsOfTheNewestMap) {
  const auto [number, reader] = join_as();
  EXPECT_EQ(ask(number, *reader, R"({"request": 1, "do": "keyframe", "id": 0})")["ok"], false);
  testing::RandomMap random(3);
  ViewUpdate update;
  update.map = random.map().freeze();
  push(std::move(update));
  tick();
  const KeyframeId root = random.map().submaps()[0].root;
  hub_.receive(number,
               R"({"request": 2, "do": "keyframe", "id": )" + std::to_string(root.value) + "}",
               now_);
  ASSERT_EQ(reader->of_type("keyframe").size(), 1u);
  EXPECT_EQ(reader->of_type("keyframe")[0]["id"], root.value);
  EXPECT_EQ(reader->of_type("keyframe")[0]["request"], 2);
  LandmarkId seen;
  random.map().landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    if (!landmark.observations.empty()) seen = id;
  });
  ASSERT_TRUE(seen.is_valid());
  hub_.receive(number,
               R"({"request": 3, "do": "landmark", "id": )" + std::to_string(seen.value) + "}",
               now_);
  ASSERT_EQ(reader->of_type("landmark").size(), 1u);
  EXPECT_EQ(reader->of_type("landmark")[0]["observations"].size(),
            random.map().landmarks().at(seen).observations.size());
}

TEST_F(Hub, WhoAsksTooMuchIsClosed) {
  const auto [number, reader] = join_as();
  for (int second = 0; second < 3; ++second) {
    for (int i = 0; i < 50; ++i) ask(number, *reader, R"({"request": 1, "do": "fly"})");
    now_ += std::chrono::seconds(1);
  }
  EXPECT_FALSE(reader->is_closed);
  for (int i = 0; i < 51; ++i) ask(number, *reader, R"({"request": 1, "do": "fly"})");
  EXPECT_TRUE(reader->is_closed);
}

TEST_F(Hub, WhoNeverReadsAnswersIsClosed) {
  const auto sleeper = std::make_shared<Sleeper>();
  sleeper->outbox = Outbox(2000);
  const std::uint64_t number = hub_.add(sleeper);
  for (int i = 0; i < 45 && !sleeper->is_closed; ++i) {
    hub_.receive(number, R"({"request": 1, "do": "fly"})", now_);
  }
  EXPECT_TRUE(sleeper->is_closed);
}

TEST_F(Hub, RatesLimitFrames) {
  const auto [number, reader] = join_as();
  tick();
  EXPECT_EQ(ask(number, *reader, R"({"request": 1, "do": "rate", "hz": 2})")["ok"], true);
  for (std::uint32_t frame = 0; frame < 20; ++frame) {  // Two seconds.
    push(frame_update(frame));
    tick();
  }
  EXPECT_GE(reader->count(MessageKind::kFrame), 4u);
  EXPECT_LE(reader->count(MessageKind::kFrame), 5u);
}

TEST_F(Hub, SeveralUpdatesBecomeOne) {
  const auto reader = join();
  tick();
  testing::RandomMap random(4);
  ViewUpdate first = frame_update(1);
  first.map = random.map().freeze();
  ViewUpdate second = frame_update(2);
  second.status.num_frames = 2;
  push(std::move(first));
  push(std::move(second));
  tick();
  EXPECT_EQ(reader->count(MessageKind::kFrame), 1u);
  EXPECT_GT(reader->count(MessageKind::kKeyframes), 0u);
  EXPECT_EQ(reader->of_type("status").back()["frames"], 2);
  EXPECT_EQ(reader->of_type("status").back()["keyframes"], random.map().keyframes().size());
}

TEST_F(Hub, WhoFellBehindGetsTheSceneAnew) {
  const auto sleeper = std::make_shared<Sleeper>();
  hub_.add(sleeper);
  sleeper->outbox = Outbox(10);
  while (sleeper->outbox.take()) continue;
  tick();
  while (sleeper->outbox.take()) continue;  // The first snapshot.
  testing::RandomMap random(5);
  ViewUpdate update;
  update.map = random.map().freeze();
  push(std::move(update));
  tick();
  bool has_begun = false;
  while (const auto outgoing = sleeper->outbox.take()) {
    if (outgoing->is_text) continue;
    has_begun |=
        MessageReader(*outgoing->message).kind == static_cast<std::uint8_t>(MessageKind::kBegin);
  }
  tick();
  while (const auto outgoing = sleeper->outbox.take()) {
    if (outgoing->is_text) continue;
    has_begun |=
        MessageReader(*outgoing->message).kind == static_cast<std::uint8_t>(MessageKind::kBegin);
  }
  EXPECT_TRUE(has_begun);
}

TEST_F(Hub, ForgetsWhoLeft) {
  const auto [number, reader] = join_as();
  hub_.remove(number);
  push(frame_update(1));
  tick();
  EXPECT_EQ(reader->count(MessageKind::kFrame), 0u);
  EXPECT_EQ(ask(number, *reader, R"({"request": 1, "do": "pause"})"), json());
  EXPECT_EQ(json::parse(hub_.status())["clients"], 0);
  EXPECT_TRUE(hub_.is_idle());
}

TEST(ClosedMapHub, TakesNoOrders) {
  ViewChannel channel;
  SessionInfo info;
  info.is_live = false;
  ViewHub hub(channel, info);
  const auto reader = std::make_shared<Reader>();
  const std::uint64_t number = hub.add(reader);
  EXPECT_TRUE(reader->of_type("hello")[0]["controls"].empty());
  hub.receive(number, R"({"request": 1, "do": "stop"})", ViewHub::Clock::now());
  EXPECT_EQ(reader->of_type("reply")[0]["ok"], false);
  hub.receive(
      number,
      R"({"request": 1, "do": "scale", "a": {"keyframe": 1}, "b": {"keyframe": 2}, "metres": 3})",
      ViewHub::Clock::now());
  EXPECT_EQ(reader->of_type("reply")[1]["ok"], false);
  EXPECT_FALSE(channel.requests.try_pop());
}

TEST(FullHub, SaysWhenRequestsPileUp) {
  ViewChannel channel;
  ViewHub hub(channel, {});
  const auto reader = std::make_shared<Reader>();
  const std::uint64_t number = hub.add(reader);
  auto now = ViewHub::Clock::now();
  for (int i = 0; i < 70; ++i) {
    if (i % 40 == 0) now += std::chrono::seconds(2);
    hub.receive(number, R"({"request": 1, "do": "pause"})", now);
  }
  EXPECT_FALSE(reader->is_closed);
  EXPECT_EQ(reader->of_type("reply").front()["ok"], true);
  EXPECT_EQ(reader->of_type("reply").back()["ok"], false);
  // Nor is there where to save.
  now += std::chrono::seconds(2);
  hub.receive(number, R"({"request": 1, "do": "save"})", now);
  EXPECT_EQ(reader->of_type("reply").back()["ok"], false);
}

}  // namespace
}  // namespace waymark

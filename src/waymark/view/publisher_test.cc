// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/publisher.h"

#include <gtest/gtest.h>

#include "waymark/camera/perspective.h"
#include "waymark/image/image_testing.h"
#include "waymark/view/hub.h"

namespace waymark {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// Stands before a wall at 2 m; RGB-D, so that the first frame has a pose.
class PublishingSession {
 public:
  PublishingSession() : depth_(kWidth, kHeight), system_(rig(), settings(), Timing::kInline) {
    std::fill(depth_.values.begin(), depth_.values.end(), std::uint16_t{2000});
  }

  FrameImages input() {
    FrameImages input;
    input.timestamp_ns = 1'000'000'000 + 50'000'000 * std::int64_t{num_frames_++};
    input.image0 = {texture_.row(0), kWidth, kHeight, texture_.stride()};
    input.depth = depth_.view();
    return input;
  }
  /// What the IMU measures until 50 ms after the next frame.
  void feed_imu() {
    const std::int64_t end_ns = 1'050'000'000 + 50'000'000 * std::int64_t{num_frames_};
    for (; imu_ns_ <= end_ns; imu_ns_ += 5'000'000) {
      const double way =
          1e-6 * static_cast<double>(imu_ns_ % 15'000'000);  // It always shows a bit.
      system_.feed_imu({imu_ns_, {1e-4 * way, 0.0, 0.0}, {0.0, -9.81, 1e-3 * way}});
    }
  }
  FrameImages black_input() {
    FrameImages black = input();
    black.image0 = black_.view();
    return black;
  }

  System& system() { return system_; }

 private:
  static Rig rig() {
    const auto camera = std::make_shared<PerspectiveCamera>(
        PerspectiveModel({300.0, 300.0}, {159.5, 119.5}), kWidth, kHeight);
    return {{{camera, Rigid3()}}};
  }
  static Settings settings() {
    Settings settings;
    settings.features.count = 300;
    return settings;
  }

  PaddedImage texture_ = testing::make_texture(kWidth, kHeight, 5);
  Image black_{kWidth, kHeight};
  DepthImage depth_;
  System system_;
  int num_frames_ = 0;
  std::int64_t imu_ns_ = 950'000'000;
};

/// The viewer's side of the channel: keeps what it is told, and takes nothing in while it sleeps.
class Listener {
 public:
  void take_in() {
    if (!is_awake) return;
    while (std::optional<ViewUpdate> update = channel.updates.try_pop()) {
      updates.push_back(*std::move(update));
    }
  }
  /// From now on the mailbox is full.
  void sleep() {
    is_awake = false;
    for (ViewUpdate filler; channel.updates.try_push(filler);) filler = ViewUpdate();
  }
  void wake_up() {
    while (channel.updates.try_pop()) continue;
    is_awake = true;
  }

  const ViewUpdate& last() {
    take_in();
    return updates.back();
  }
  const SessionStatus& status() { return last().status; }

  ViewChannel channel;
  std::vector<ViewUpdate> updates;
  bool is_awake = true;
};

class Publisher : public ::testing::Test {
 protected:
  TrackingResult feed(const FrameImages& input) {
    const TrackingResult result = session_.system().feed(input);
    publisher_.tell(session_.system(), input, result);
    listener_.take_in();
    return result;
  }

  PublishingSession session_;
  Listener listener_;
  ViewPublisher publisher_{listener_.channel, 40};
};

TEST_F(Publisher, TellsOfEachFrame) {
  EXPECT_EQ(listener_.status().phase, SessionPhase::kStarting);
  EXPECT_EQ(listener_.status().num_frames_total, 40u);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const TrackingResult result = feed(session_.input());
    ASSERT_EQ(listener_.updates.size(), i + 2);
    const ViewUpdate& update = listener_.last();
    EXPECT_EQ(update.status.phase, SessionPhase::kRunning);
    EXPECT_EQ(update.status.frame, FrameId{i});
    EXPECT_EQ(update.status.num_frames, i + 1);
    EXPECT_EQ(update.status.num_tracked, i + 1);
    EXPECT_EQ(update.status.newest.num_inliers, result.num_inliers);
    EXPECT_NEAR(update.status.time_s, 0.05 * i, 1e-12);
    EXPECT_EQ(update.map, session_.system().map());
    ASSERT_EQ(update.frames.size(), 1u);
    EXPECT_EQ(update.frames[0].frame, FrameId{i});
    EXPECT_TRUE(update.frames[0].pose);
    ASSERT_EQ(update.colors.size(), 1u);
    EXPECT_EQ(update.colors[0].rgb.size(), session_.system().result().features->num_primary);
    EXPECT_EQ(update.image, nullptr) << "nobody asked for one";
  }
}

TEST_F(Publisher, GivesAnImageWhereOneIsWished) {
  listener_.channel.wants_image = true;
  const FrameImages input = session_.input();
  feed(input);
  const auto image = listener_.last().image;
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->image.width_px, kWidth);
  EXPECT_EQ(image->image.view().at(17, 33), input.image0.at(17, 33));
  EXPECT_EQ(image->features, session_.system().result().features);
  feed(session_.input());
  EXPECT_EQ(listener_.last().image, nullptr);
}

TEST_F(Publisher, DarkensWhatIsMasked) {
  listener_.channel.wants_image = true;
  FrameImages input = session_.input();
  Image mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) std::fill_n(mask.row(y), kWidth / 2, 255);
  input.mask = mask.view();
  feed(input);
  const ImageView image = listener_.last().image->image.view();
  EXPECT_EQ(image.at(17, 33), input.image0.at(17, 33));
  EXPECT_EQ(image.at(kWidth - 17, 33), input.image0.at(kWidth - 17, 33) / 3);
}

TEST_F(Publisher, CountsLossesAndFramesThatWereNotFed) {
  feed(session_.input());
  feed(session_.black_input());
  feed(session_.black_input());
  EXPECT_EQ(listener_.status().lost_count, 1u);
  EXPECT_EQ(listener_.status().newest.reason, FrameReason::kNoFeatures);
  EXPECT_FALSE(listener_.last().frames.back().pose);
  feed(session_.input());
  feed(session_.black_input());
  EXPECT_EQ(listener_.status().lost_count, 2u);
  publisher_.skip({.state = FrameState::kUnreadable, .reason = FrameReason::kUnreadableImage});
  publisher_.skip({.state = FrameState::kDropped, .reason = FrameReason::kLate});
  EXPECT_EQ(listener_.status().num_unreadable, 1u);
  EXPECT_EQ(listener_.status().num_dropped, 1u);
  EXPECT_EQ(listener_.status().num_frames, 7u);
  EXPECT_EQ(listener_.status().newest.state, FrameState::kDropped);
}

TEST_F(Publisher, LosesNothingWhereTheViewerTakesNoUpdate) {
  feed(session_.input());
  const std::size_t num_before = listener_.updates.size();
  listener_.sleep();
  for (int i = 0; i < 5; ++i) feed(session_.input());
  publisher_.set_phase(SessionPhase::kPaused);
  EXPECT_EQ(listener_.updates.size(), num_before);
  listener_.wake_up();
  publisher_.set_mapping(false);
  listener_.take_in();
  ASSERT_EQ(listener_.updates.size(), num_before + 1);
  EXPECT_EQ(listener_.last().frames.size(), 5u);
  EXPECT_EQ(listener_.last().colors.size(), 5u);
  EXPECT_EQ(listener_.status().phase, SessionPhase::kPaused);
  EXPECT_FALSE(listener_.status().is_mapping);
  feed(session_.input());
  EXPECT_EQ(listener_.last().frames.size(), 1u) << "each is told once";
}

TEST_F(Publisher, AResetVoidsEverything) {
  feed(session_.input());
  feed(session_.input());
  session_.system().reset();
  publisher_.reset();
  EXPECT_TRUE(listener_.last().is_reset);
  EXPECT_TRUE(listener_.last().map->keyframes().is_empty());
  EXPECT_EQ(listener_.status().num_frames, 0u);
  EXPECT_EQ(listener_.status().num_frames_total, 40u);
  feed(session_.input());
  EXPECT_FALSE(listener_.last().is_reset);
  EXPECT_EQ(listener_.status().time_s, 0.0);
  EXPECT_EQ(listener_.status().frame, FrameId{0});
}

TEST_F(Publisher, TellsTheFinalPosesAtTheEnd) {
  for (int i = 0; i < 4; ++i) feed(session_.input());
  feed(session_.black_input());
  session_.system().finish();
  publisher_.finish(session_.system());
  EXPECT_EQ(listener_.status().phase, SessionPhase::kDone);
  EXPECT_EQ(listener_.status().num_tracked, 4u);
  ASSERT_EQ(listener_.last().frames.size(), 4u);
  const std::vector<TrajectoryFrame> trajectory = session_.system().trajectory();
  for (std::size_t i = 0; i < 4; ++i) {
    const FrameSummary& note = listener_.last().frames[i];
    ASSERT_TRUE(note.final_pose);
    EXPECT_EQ(note.final_pose->matrix(), trajectory[i].world_from_rig.matrix());
  }
}

TEST_F(Publisher, TellsOfAnImuWhereThereIsOne) {
  feed(session_.input());
  EXPECT_FALSE(listener_.status().imu);
  session_.feed_imu();
  feed(session_.input());
  ASSERT_TRUE(listener_.status().imu);
  EXPECT_EQ(listener_.status().imu->rate_hz, 200.0);
  EXPECT_FALSE(listener_.status().imu->is_used);
  EXPECT_EQ(listener_.status().imu->reason, "") << "not compared yet";
  for (int i = 0; i < 40; ++i) {
    session_.feed_imu();
    feed(session_.input());
  }
  const std::optional<InertialReport>& report = session_.system().inertial();
  ASSERT_TRUE(report && report->is_used) << report->reason;
  const ImuStatus imu = *listener_.status().imu;
  EXPECT_TRUE(imu.is_used);
  EXPECT_EQ(imu.submap, SubmapId{0});
  ASSERT_TRUE(imu.gravity);
  EXPECT_LT((*imu.gravity - Eigen::Vector3d::UnitY()).norm(), 0.01);
  session_.system().finish();
  publisher_.finish(session_.system());
  ASSERT_TRUE(listener_.status().imu->gravity);
  EXPECT_LT((*listener_.status().imu->gravity + Eigen::Vector3d::UnitZ()).norm(), 0.01)
      << "the map is level in the end";
}

TEST_F(Publisher, TellsWhyAnImuIsLeftOutAlsoAfterAReset) {
  publisher_.leave_out_imu("it always shows the same");
  for (int i = 0; i < 2; ++i) {
    feed(session_.input());
    ASSERT_TRUE(listener_.status().imu);
    EXPECT_EQ(listener_.status().imu->reason, "it always shows the same");
    EXPECT_FALSE(listener_.status().imu->rate_hz || listener_.status().imu->is_used);
    session_.system().reset();
    publisher_.reset();
  }
}

TEST_F(Publisher, TellsAPhaseOnce) {
  listener_.take_in();
  const std::size_t num_before = listener_.updates.size();
  publisher_.set_phase(SessionPhase::kPaused);
  publisher_.set_phase(SessionPhase::kPaused);
  listener_.take_in();
  EXPECT_EQ(listener_.updates.size(), num_before + 1);
}

}  // namespace
}  // namespace waymark

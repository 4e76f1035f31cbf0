// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A camera that stands still for long: what a session holds must not grow with time.
#include <gtest/gtest.h>
#include <malloc.h>

#include <variant>
#include <vector>

#include "waymark/loop/global_mapper.h"
#include "waymark/match/test_scene.h"
#include "waymark/track/tracker.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumRestingFrames = 10000;
constexpr int kNumRestingViews = 16;

/// A pose near the origin.
Rigid3 beside(double x) { return make_test_pose({x, 0.0, 0.0}, Eigen::Vector3d::Zero()); }

/// Tracker and mapper by hand, the map being visible in the frame after each message.
class RestingSession {
 public:
  explicit RestingSession(int num_cameras)
      : rig_(make_test_rig(num_cameras)),
        tracker_(rig_, num_cameras > 1, TrackingSettings{}, 1),
        mapper_(rig_, MappingSettings{}, LoopSettings{}, 1),
        visible_(mapper_.snapshot()) {}

  /// One of a few noisy looks from a place, which are made once.
  void look_from(const Rigid3& world_from_rig, int num_views) {
    views_.clear();
    for (int i = 0; i < num_views; ++i) {
      views_.push_back(observe(cloud_, *rig_, world_from_rig, noise_, num_looks_++).features);
    }
  }

  TrackOutcome track() {
    StageTimes times;
    const Frame frame{FrameId{num_frames_},
                      50'000'000 * std::int64_t{num_frames_},
                      views_[num_frames_ % views_.size()]};
    ++num_frames_;
    TrackOutcome outcome = tracker_.track(frame, visible_, times);
    if (outcome.message) {
      std::visit([&](const auto& message) { mapper_.add(message); }, *outcome.message);
      visible_ = mapper_.snapshot();
    }
    return outcome;
  }

  /// Moves sideways until there is a map and a pose in it.
  void begin() {
    for (int i = 0; i < 30; ++i) {
      look_from(beside(0.02 * i), 1);
      track();
    }
    look_from(beside(0.02 * 29), kNumRestingViews);
  }

  const Map& map() const { return *visible_.map; }

 private:
  std::shared_ptr<const Rig> rig_;
  PointCloud cloud_ = scatter_in({-3.0, -2.0, 2.0}, {4.0, 2.0, 5.0}, 700, 3.0, 3);
  PointNoise noise_{.seed = 4, .max_features = 250};
  Tracker tracker_;
  GlobalMapper mapper_;
  MapSnapshot visible_;
  std::vector<std::shared_ptr<const Features>> views_;
  std::uint64_t num_looks_ = 0;
  std::uint32_t num_frames_ = 0;
};

/// Bytes that are allocated now; 0 where a sanitizer has its own allocator.
std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

class AtRest : public ::testing::TestWithParam<int> {};

TEST_P(AtRest, NothingGrowsWithTime) {
  RestingSession session(GetParam());
  session.begin();
  ASSERT_GT(session.map().keyframes().size(), 0u);
  std::size_t bytes_early = 0, keyframes_early = 0, landmarks_early = 0;
  for (std::uint32_t i = 0; i < kNumRestingFrames; ++i) {
    ASSERT_EQ(session.track().state, FrameState::kTracked) << "frame " << i;
    if (i != kNumRestingFrames / 10) continue;
    bytes_early = bytes_in_use();
    keyframes_early = session.map().keyframes().size();
    landmarks_early = session.map().landmarks().size();
  }
  EXPECT_EQ(session.map().keyframes().size(), keyframes_early);
  EXPECT_EQ(session.map().landmarks().size(), landmarks_early);
  EXPECT_LE(keyframes_early, 6u);
  // What is counted between keyframes has room for a while: much less than what frames hold.
  EXPECT_LT(bytes_in_use(), bytes_early + (std::size_t{4} << 20));
}

/// What the tracker counted meanwhile arrives with the next keyframe: each landmark once.
TEST_P(AtRest, SightingsAreCountedOncePerLandmark) {
  RestingSession session(GetParam());
  session.begin();
  constexpr std::uint32_t kRest = 500;
  for (std::uint32_t i = 0; i < kRest; ++i) session.track();
  const std::size_t num_landmarks = session.map().landmarks().end_id().value;
  for (int i = 0; i < 200; ++i) {
    session.look_from(beside(0.58 + 0.02 * i), 1);
    const TrackOutcome outcome = session.track();
    if (!outcome.message) continue;
    const auto& sightings = std::get<NewKeyframe>(*outcome.message).sightings;
    ASSERT_FALSE(sightings.empty());
    EXPECT_LE(sightings.size(), num_landmarks);
    std::uint32_t most = 0;
    for (const Sighting& sighting : sightings) {
      EXPECT_LE(sighting.num_found, kRest + 1 + static_cast<std::uint32_t>(i));
      most = std::max(most, sighting.num_visible);
    }
    EXPECT_GT(most, kRest / 2);
    return;
  }
  FAIL() << "no keyframe";
}

INSTANTIATE_TEST_SUITE_P(Setups, AtRest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/tracker.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <variant>

#include "waymark/track/testing/map.h"
#include "waymark/track/testing/tracked.h"

namespace waymark {
namespace {

constexpr int kMaxFrames = 40;

/// Slowly to the side, looking ahead. The world is the first frame.
Rigid3 path(double frame) { return pose_at(0.02 * frame, 0.0, 0.0, 0.001 * frame); }

/// A stereo rig before a cloud, and a map as a mapper without mistakes would make it of the
/// tracker's messages: every feature of a keyframe is associated with what it shows.
class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() : scene_(2, cloud(), {.seed = 4}, true), tracker_(make_tracker()) {}

  static PointCloud cloud() { return scatter_in({-3, -2, 2}, {4, 2, 5}, 1500, 3.0, 3); }

  std::unique_ptr<Tracker> make_tracker() const {
    return std::make_unique<Tracker>(true, TrackingSettings{}, 1);
  }

  Tracked track(std::uint32_t number,
                const Features& features,
                const std::function<std::optional<ReckonedPose>()>& dead_reckon = nullptr,
                bool is_at_rest = false) {
    Frame frame{FrameId{number},
                50'000'000 * std::int64_t{number},
                std::make_shared<const Features>(features)};
    frame.dead_reckon = dead_reckon;
    frame.is_at_rest = is_at_rest;
    Tracked outcome;
    outcome.message = tracker_->track(frame, {map_, places_}, outcome);
    return outcome;
  }

  /// With the image; whether that took a search among keyframes.
  bool recovers(std::uint32_t number, const Rigid3& world_from_rig) {
    Tracked outcome;
    const Frame frame{FrameId{number},
                      50'000'000 * std::int64_t{number},
                      scene_.look(world_from_rig, number).features,
                      far_image(*scene_.rig->cameras[0].camera, world_from_rig)};
    outcome.message = tracker_->track(frame, {map_, places_}, outcome);
    expect_pose(outcome, world_from_rig);
    return tracker_->found_by() != "motion";
  }

  /// Tracks a view and lets the mapper answer.
  Tracked track(std::uint32_t number, const Rigid3& world_from_rig) {
    Tracked outcome = track(number, *scene_.look(world_from_rig, number).features);
    if (outcome.message) {
      scene_.add_keyframe(world_from_rig);
      map_ = scene_.map.freeze();
    }
    return outcome;
  }

  /// Tracks along the path and ends before a frame.
  void follow_path(std::uint32_t end) {
    for (std::uint32_t i = 0; i < end; ++i) {
      ASSERT_EQ(track(i, path(i)).state, FrameState::kTracked) << i;
    }
  }

  static void expect_pose(const Tracked& outcome, const Rigid3& world_from_rig) {
    ASSERT_TRUE(outcome.world_from_rig);
    const Vector6d error = (world_from_rig.inverse() * *outcome.world_from_rig).log();
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.005);
  }

  TestMap scene_;
  std::unique_ptr<Tracker> tracker_;
  std::shared_ptr<const Map> map_ = std::make_shared<const Map>();
  std::shared_ptr<const PlaceIndex> places_ = std::make_shared<const PlaceIndex>();
};

TEST_F(TrackerTest, StartsASubmapAndThenFollows) {
  const Tracked first = track(0, path(0));
  EXPECT_EQ(first.state, FrameState::kTracked);
  ASSERT_TRUE(first.message);
  EXPECT_TRUE(std::holds_alternative<NewSubmap>(*first.message));
  for (std::uint32_t i = 1; i < kMaxFrames; ++i) {
    const Tracked outcome = track(i, path(i));
    ASSERT_EQ(outcome.state, FrameState::kTracked) << i;
    EXPECT_EQ(outcome.reason, FrameReason::kNone);
    expect_pose(outcome, path(i));
    EXPECT_GE(outcome.num_matches, outcome.num_inliers);
    EXPECT_GT(outcome.covariance.trace(), 0.0);
    // The pose is the same by reference.
    if (outcome.message) continue;  // The mapper puts keyframes where they truly are.
    const RelativePose& pose = outcome.pose;
    const Rigid3 again =
        map_->rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
    EXPECT_TRUE(again.inverse().matrix().isApprox(outcome.world_from_rig->matrix(), 1e-9));
  }
}

TEST_F(TrackerTest, AsksForKeyframesWithConsecutiveIdsAndTrueAssociations) {
  std::uint32_t num_keyframes = 1;
  int num_right = 0, num_wrong = 0;
  track(0, path(0));
  for (std::uint32_t i = 1; i < 2 * kMaxFrames; ++i) {
    const Rigid3 pose = path(2.0 * i);  // Twice as fast.
    const PointObservation view = scene_.look(pose, i);
    const std::vector<LandmarkId> truth = scene_.true_associations(view);
    const Tracked outcome = track(i, pose);
    ASSERT_EQ(outcome.state, FrameState::kTracked) << i;
    if (!outcome.message) continue;
    EXPECT_EQ(outcome.pose.reference, KeyframeId{num_keyframes++});
    const auto& message = std::get<NewKeyframe>(*outcome.message);
    EXPECT_EQ(message.frame, FrameId{i});
    ASSERT_EQ(message.landmarks.size(), view.features->size());
    for (std::uint32_t k = 0; k < view.features->num_primary; ++k) {
      if (!message.landmarks[k].is_valid()) continue;
      (message.landmarks[k] == truth[k] ? num_right : num_wrong) += 1;
    }
    for (std::size_t k = 1; k < message.visibility.size(); ++k) {
      EXPECT_LT(message.visibility[k - 1].landmark, message.visibility[k].landmark);
    }
    for (const LandmarkVisibility& seen : message.visibility) {
      EXPECT_GT(seen.num_visible + seen.num_found, 0u);
    }
  }
  EXPECT_GE(num_keyframes, 3u) << "3 metres past a scene 2 to 5 metres away";
  EXPECT_GT(num_right, 300);
  EXPECT_LT(num_wrong, num_right / 50);
}

TEST_F(TrackerTest, MovesWithTheMap) {
  follow_path(10);
  // The mapper finds that everything stands elsewhere.
  const Rigid3 moved = make_test_pose({1.0, -2.0, 0.5}, {0.1, 0.4, -0.2});
  std::vector<std::pair<KeyframeId, Rigid3>> poses;
  map_->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    poses.emplace_back(id, keyframe.rig_from_world * moved.inverse());
  });
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;
  map_->landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    points.emplace_back(id, moved * landmark.position_in_world);
  });
  for (const auto& [id, pose] : poses) scene_.map.move_keyframe(id, pose);
  for (const auto& [id, point] : points) {
    scene_.map.move_landmark(id, point);
    Appearance appearance = scene_.map.landmarks().at(id).appearance;
    appearance.direction = moved.rotation * appearance.direction;
    scene_.map.set_appearance(id, appearance);
  }
  map_ = scene_.map.freeze();
  const Tracked outcome = track(10, *scene_.look(path(10), 10).features);
  ASSERT_EQ(outcome.state, FrameState::kTracked);
  expect_pose(outcome, moved * path(10));
}

TEST_F(TrackerTest, IsLostWhereItSeesNothingKnownAndRecoversWhereItDoes) {
  follow_path(10);
  const Tracked away = track(10, pose_at(0.2, 0.0, 0.0, 3.1));
  EXPECT_EQ(away.state, FrameState::kLost);
  EXPECT_NE(away.reason, FrameReason::kNone);
  EXPECT_FALSE(away.world_from_rig);
  EXPECT_FALSE(away.message);
  // Back, but not where the motion would have led.
  const Tracked back = track(11, pose_at(0.05, 0.05, -0.1, -0.03));
  ASSERT_EQ(back.state, FrameState::kTracked);
  expect_pose(back, pose_at(0.05, 0.05, -0.1, -0.03));
  EXPECT_EQ(track(12, path(3)).state, FrameState::kTracked);
}

TEST_F(TrackerTest, ExtendsAMapMadeBefore) {
  follow_path(30);
  const std::uint32_t num_keyframes = map_->keyframes().end_id().value;
  places_ = index_map(map_).places;
  tracker_ = make_tracker();
  tracker_->begin_in(*map_, TrackingPurpose::kMapping);
  const Tracked found = track(50, path(12));
  EXPECT_TRUE(found.is_relocalized);
  expect_pose(found, path(12));
  std::uint32_t num_new = found.message.has_value();
  for (std::uint32_t i = 51; i < 100; ++i) {
    const Tracked outcome = track(i, path(12 + 3 * (i - 50)));
    ASSERT_EQ(outcome.state, FrameState::kTracked) << i;
    if (!outcome.message) continue;
    EXPECT_EQ(outcome.pose.reference, KeyframeId{num_keyframes + num_new++});
    EXPECT_TRUE(std::holds_alternative<NewKeyframe>(*outcome.message));
  }
  EXPECT_GE(num_new, 2u);
}

TEST_F(TrackerTest, BeginsASubmapWhereTheMapDoesNotHelp) {
  follow_path(5);
  places_ = index_map(map_).places;
  tracker_ = make_tracker();
  tracker_->begin_in(*map_, TrackingPurpose::kMapping);
  scene_.cloud = scatter_in({-3, -2, 2}, {4, 2, 5}, 1500, 3.0, 99);
  for (std::uint32_t i = 10; i < 20; ++i) {
    const Tracked outcome = track(i, *scene_.look(path(i), i).features);
    if (outcome.state == FrameState::kLost) continue;
    ASSERT_TRUE(outcome.message);
    EXPECT_TRUE(std::holds_alternative<NewSubmap>(*outcome.message));
    EXPECT_EQ(outcome.submap, SubmapId{1});
    return;
  }
  FAIL() << "no sub-map";
}

TEST_F(TrackerTest, LeavesTheMapAloneWhereItOnlyLocalizes) {
  follow_path(30);
  places_ = index_map(map_).places;
  tracker_ = make_tracker();
  tracker_->begin_in(*map_, TrackingPurpose::kLocalizing);
  for (std::uint32_t i = 0; i < 30; ++i) {
    const bool is_away = i >= 10 && i < 20;
    const Rigid3 pose = is_away ? pose_at(0.2, 0.0, 0.0, 3.1) : path(3 + 0.9 * i);
    const Tracked outcome = track(i, pose);
    EXPECT_EQ(outcome.state, is_away ? FrameState::kLost : FrameState::kTracked) << i;
    EXPECT_FALSE(outcome.message);
    if (!is_away) expect_pose(outcome, pose);
  }
}

TEST_F(TrackerTest, SaysThatAFrameHasNoFeatures) {
  follow_path(5);
  const Tracked outcome = track(5, Features{});
  EXPECT_EQ(outcome.state, FrameState::kLost);
  EXPECT_EQ(outcome.reason, FrameReason::kNoFeatures);
  EXPECT_EQ(track(6, path(6)).state, FrameState::kTracked);
}

TEST_F(TrackerTest, GoesOnWithTheMotionWhereImagesShowedNothing) {
  // Twenty points look like each, so that only where they should be tells which is seen.
  auto& points = scene_.cloud.landmarks;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].descriptor = points[i - i % 20].descriptor;
  }
  std::uint32_t number = 0;
  for (; number < 10; ++number) {
    ASSERT_EQ(track(number, path(6.0 * number)).state, FrameState::kTracked) << number;
  }
  for (; number < 18; ++number) EXPECT_EQ(track(number, Features{}).state, FrameState::kLost);
  const Rigid3 ahead = path(6.0 * number);  // Farther than the widest search reaches.
  const Tracked outcome = track(number, ahead);
  ASSERT_EQ(outcome.state, FrameState::kTracked);
  expect_pose(outcome, ahead);
}

TEST_F(TrackerTest, IsCarriedOnByAnImuWhereImagesShowNothing) {
  follow_path(20);
  const auto reckoned_at = [&](const Rigid3& world_from_rig) {
    return [=] {
      return std::optional(ReckonedPose{world_from_rig.inverse() * path(19), Matrix6d::Identity()});
    };
  };
  for (std::uint32_t i = 20; i < 60; ++i) {
    const Rigid3 there = pose_at(-0.2, 0.1, 0.0, 0.02 * (i - 20.0));
    const Tracked outcome = track(i, Features{}, reckoned_at(there));
    EXPECT_EQ(outcome.state, FrameState::kFilled);
    EXPECT_EQ(outcome.submap, SubmapId{0});
    EXPECT_EQ(outcome.covariance, Matrix6d::Identity());
    EXPECT_FALSE(outcome.message);
    expect_pose(outcome, there);
  }
  // The map is found from there, which is not where it was seen last.
  const Rigid3 back = pose_at(-0.1, 0.1, 0.0, -0.2);
  const auto features = scene_.look(back, 60).features;
  const Tracked outcome = track(60, *features, reckoned_at(pose_at(-0.13, 0.12, 0.02, -0.18)));
  EXPECT_EQ(outcome.state, FrameState::kTracked);
  EXPECT_EQ(tracker_->found_by(), "inertial");
  expect_pose(outcome, back);
}

TEST_F(TrackerTest, BeginsASubmapWhereAnImuIsButNothingIsKnown) {
  follow_path(5);
  scene_.cloud = scatter_in({-3, -2, 2}, {4, 2, 5}, 1500, 3.0, 99);
  const auto dead_reckon = [] { return std::optional(ReckonedPose{}); };
  std::uint32_t number = 5;
  Tracked outcome;
  do {
    outcome = track(number, *scene_.look(path(number), number).features, dead_reckon);
    EXPECT_TRUE(outcome.world_from_rig);
  } while (outcome.submap == SubmapId{0} && ++number < 30);
  EXPECT_EQ(outcome.submap, SubmapId{1});
  EXPECT_GT(number, 10u);
}

/// Most of what is seen goes to the side.
TEST_F(TrackerTest, RestsWhereAnImuDoesWhateverGoesBy) {
  for (std::uint32_t i = 0; i < 5; ++i) track(i, pose_at(0.0, 0.0, 0.0, 0.0));
  const PointCloud around = scene_.cloud;
  for (std::uint32_t i = 5; i < 60; ++i) {
    scene_.cloud = around;
    auto& points = scene_.cloud.landmarks;
    const double aside = 0.3 + 0.02 * (i - 4.0);
    for (std::size_t k = 0; k < points.size(); ++k) {
      // For a while all of it.
      if (k % 5 != 0 || (i > 30 && i < 36)) points[k].position.x() += aside;
    }
    const auto features = scene_.look(pose_at(0.0, 0.0, 0.0, 0.0), i).features;
    expect_pose(track(i, *features, nullptr, true), pose_at(0.0, 0.0, 0.0, 0.0));
  }
}

TEST_F(TrackerTest, IsNotAtRestWhereItGoesStraightOn) {
  for (std::uint32_t i = 0; i < 40; ++i) {
    const Rigid3 slide = pose_at(0.02 * i, 0.0, 0.0, 0.0);
    const auto features = scene_.look(slide, i).features;
    Tracked outcome = track(i, *features, nullptr, i > 5);
    if (outcome.message) {
      scene_.add_keyframe(slide);
      map_ = scene_.map.freeze();
    }
    expect_pose(outcome, slide);
  }
}

TEST_F(TrackerTest, FollowsASuddenTurn) {
  follow_path(10);
  // 40 px: more than the motion model expects, less than the widest search.
  const Rigid3 turned = pose_at(0.2, 0.0, 0.0, 0.01 + 30.0 / 420.0);
  const Tracked outcome = track(10, turned);
  ASSERT_EQ(outcome.state, FrameState::kTracked);
  expect_pose(outcome, turned);
}

TEST_F(TrackerTest, IsToldOfASuddenTurnByTheImage) {
  follow_path(5);
  const Rigid3 turned = pose_at(0.1, 0.0, 0.0, -0.5);  // By 210 px.
  EXPECT_FALSE(recovers(5, path(5)));
  EXPECT_FALSE(recovers(6, turned));
  // The frame before this one had no image.
  EXPECT_EQ(track(7, turned).state, FrameState::kTracked);
  EXPECT_TRUE(recovers(8, path(5)));
}

TEST_F(TrackerTest, StaysInitializingWhileThereAreNoFeatures) {
  const Tracked outcome = track(0, Features{});
  EXPECT_EQ(outcome.state, FrameState::kInitializing);
  EXPECT_EQ(outcome.reason, FrameReason::kNoFeatures);
  EXPECT_EQ(track(1, path(1)).state, FrameState::kTracked);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/map_view.h"

#include <gtest/gtest.h>

#include "waymark/track/test_map.h"

namespace waymark {
namespace {

/// A frame between two keyframes, located when the map was not as good as it is now.
class MapViewTest : public ::testing::TestWithParam<int> {
 protected:
  MapViewTest() : scene_(GetParam(), cloud_ahead(), {.seed = 5}, true) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
    const PointObservation seen = scene_.look(truth_, 100);
    view_ = view_of(*seen.features, scene_.true_associations(seen));
    const Vector6d wrong = (Vector6d() << 0.08, -0.05, 0.06, 0.01, -0.01, 0.02).finished();
    pose_ = {KeyframeId{0}, Rigid3::exp(wrong) * truth_.inverse() * pose_at(0.0), 1.0};
  }

  std::optional<RelativePose> locate() {
    return locate_again(view_, scene_.map, *scene_.rig, pose_, workspace_);
  }

  void expect_pose(const std::optional<RelativePose>& pose, const Rigid3& world_from_rig) const {
    ASSERT_TRUE(pose);
    const Rigid3 rig_from_world =
        scene_.map.rig_from_world(pose->reference, pose->rig_from_reference, pose->reference_scale);
    const Vector6d error = (rig_from_world * world_from_rig).log();
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.004);
  }

  /// Erases the landmarks of the view that a test says.
  template <class Test>
  void erase(Test is_gone) {
    for (std::size_t i = 0; i < view_.landmarks.size(); ++i) {
      if (is_gone(i) && scene_.map.landmarks().contains(view_.landmarks[i])) {
        scene_.map.erase_landmark(view_.landmarks[i]);
      }
    }
  }

  const Rigid3 truth_ = pose_at(0.3, 0.1, 0.2, 0.03);
  TestMap scene_;
  MapView view_;
  RelativePose pose_;
  PoseWorkspace workspace_;
};

TEST_P(MapViewTest, FindsTheFrameInTheMapAsItIsNow) {
  ASSERT_GT(view_.landmarks.size(), 200u);
  expect_pose(locate(), truth_);
}

TEST_P(MapViewTest, FollowsAnErasedReferenceAndMergedLandmarks) {
  pose_.reference = KeyframeId{1};
  pose_.rig_from_reference = truth_.inverse() * pose_at(0.5);
  for (std::size_t i = 0; i < view_.landmarks.size(); ++i) {
    const LandmarkId id = view_.landmarks[i];
    if (!scene_.map.landmarks().contains(id)) continue;
    const Landmark& landmark = scene_.map.landmarks().at(id);
    const LandmarkId twin =
        scene_.map.add_landmark(scene_.submap, landmark.position_in_world, KeyframeId{0});
    scene_.map.merge_landmarks(twin, id);
  }
  scene_.map.erase_keyframe(KeyframeId{1});
  const std::optional<RelativePose> pose = locate();
  expect_pose(pose, truth_);
  EXPECT_EQ(pose->reference, KeyframeId{0});
}

TEST_P(MapViewTest, DoesWithoutPartOfWhatItSaw) {
  erase([](std::size_t i) { return i % 3 == 0; });
  expect_pose(locate(), truth_);
}

TEST_P(MapViewTest, GivesUpWhereMostIsGone) {
  erase([](std::size_t i) { return i % 3 != 0; });
  EXPECT_FALSE(locate());
}

TEST_P(MapViewTest, GivesUpWhereMostIsElsewhere) {
  Rng rng(1, 0);
  for (const LandmarkId id : view_.landmarks) {
    const Eigen::Vector3d& point = scene_.map.landmarks().at(id).position_in_world;
    const Eigen::Vector3d away(rng.normal(), rng.normal(), rng.normal());
    if (rng.uniform() < 0.8) scene_.map.move_landmark(id, point + away);
  }
  EXPECT_FALSE(locate());
}

INSTANTIATE_TEST_SUITE_P(Cameras, MapViewTest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

}  // namespace
}  // namespace waymark

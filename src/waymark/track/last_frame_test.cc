// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/last_frame.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// A frame between two keyframes.
class LastFrameTest : public ::testing::Test {
 protected:
  LastFrameTest() : scene_(1, cloud_ahead(), {.seed = 5}, false) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
    set(0, pose_at(0.2));
  }

  void set(std::uint32_t number, const Rigid3& world_from_rig) {
    const PointObservation view = scene_.look(world_from_rig, 100 + number);
    const Rigid3 rig_from_world = world_from_rig.inverse();
    const Keyframe& reference = scene_.map.keyframes().at(KeyframeId{1});
    last_.set({FrameId{number}, std::int64_t{number} * 100, view.features},
              {KeyframeId{1}, 1.0, rig_from_world * reference.rig_from_world.inverse()},
              rig_from_world,
              scene_.true_associations(view));
  }

  double error_m(std::int64_t timestamp_ns, double x) const {
    return (last_.predict(timestamp_ns).origin_in_source() - Eigen::Vector3d(x, 0, 0)).norm();
  }

  TestMap scene_;
  LastFrame last_;
};

TEST_F(LastFrameTest, PredictsThatTheMotionGoesOnUntilToldOtherwise) {
  set(1, pose_at(0.3));
  EXPECT_LT(error_m(300, 0.5), 1e-9);
  last_.forget_motion();
  set(2, pose_at(0.4));
  EXPECT_LT(error_m(300, 0.4), 1e-9);
}

TEST_F(LastFrameTest, MovesWithItsKeyframe) {
  const Rigid3 moved = make_test_pose({1.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
  scene_.map.move_keyframe(KeyframeId{1}, (moved * pose_at(0.5)).inverse());
  last_.carry_over(scene_.map);
  EXPECT_LT(error_m(100, 1.2), 1e-9);
}

TEST_F(LastFrameTest, GivesItsOwnDescriptorsOfLandmarksThatLive) {
  const std::size_t before = last_.landmarks(scene_.map).size();
  ASSERT_GT(before, 100u);
  const LandmarkId survivor = last_.landmarks(scene_.map).ids[0];
  const LandmarkId absorbed = last_.landmarks(scene_.map).ids[1];
  const LandmarkId erased = last_.landmarks(scene_.map).ids[2];
  const Descriptor seen = last_.landmarks(scene_.map).descriptors[1];
  scene_.map.merge_landmarks(survivor, absorbed);
  scene_.map.erase_landmark(erased);
  last_.carry_over(scene_.map);
  const LandmarkSet& set = last_.landmarks(scene_.map);
  EXPECT_EQ(set.size(), before - 1);
  EXPECT_EQ(set.ids[1], survivor);
  EXPECT_EQ(set.descriptors[1], seen);
}

TEST_F(LastFrameTest, AFrameThatBeganASubmapSeesWhatItsKeyframeSees) {
  last_.set({FrameId{3}, 300, scene_.seen[1].features},
            {KeyframeId{1}, 1.0, Rigid3{}},
            scene_.map.keyframes().at(KeyframeId{1}).rig_from_world,
            {});
  last_.carry_over(scene_.map);
  EXPECT_EQ(last_.landmarks(scene_.map).size(), scene_.seen[1].features->num_primary);
}

TEST_F(LastFrameTest, RefersToAnotherKeyframeWhereItsOwnIsMissing) {
  const auto whole = scene_.map.freeze();
  scene_.map.erase_keyframe(KeyframeId{1});
  last_.forget_missing(*whole, scene_.map, KeyframeId{0});
  EXPECT_EQ(last_.reference(), KeyframeId{0});
  last_.carry_over(scene_.map);
  EXPECT_LT(error_m(100, 0.2), 1e-9);
  EXPECT_LT(last_.landmarks(scene_.map).size(), last_.landmarks(*whole).size() + 1);
  last_.forget_missing(scene_.map, Map(), KeyframeId{});
  EXPECT_FALSE(last_.has_pose());
}

}  // namespace
}  // namespace waymark

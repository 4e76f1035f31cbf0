// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_refiner.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// Two keyframes, and what a frame between them saw. Its pose was found while the map was a tenth
/// too small.
class PoseRefinerTest : public ::testing::TestWithParam<int> {
 protected:
  PoseRefinerTest() : scene_(GetParam(), cloud_ahead(), {.seed = 5}, false) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
    view_ = scene_.look(truth_, 100);
    seen_ = seen_landmarks(*view_.features, scene_.true_associations(view_));
    stale_ = truth_.inverse();
    stale_.translation *= 0.9;
  }

  double error_m(const Rigid3& rig_from_world) const {
    return (rig_from_world.origin_in_source() - truth_.translation).norm();
  }

  const Rigid3 truth_ = pose_at(0.3, 0.1, 0.2, 0.03);
  TestMap scene_;
  PoseRefiner refiner_;
  PointObservation view_;
  std::vector<SeenLandmark> seen_;
  Rigid3 stale_;
};

TEST_P(PoseRefinerTest, MendsAPoseFromAWrongMap) {
  ASSERT_GT(seen_.size(), 200u);
  ASSERT_GT(error_m(stale_), 0.03);
  const auto refined = refiner_.refine(*scene_.rig, scene_.map, seen_, stale_);
  ASSERT_TRUE(refined);
  EXPECT_LT(error_m(*refined), 0.01);
}

TEST_P(PoseRefinerTest, FollowsMergesAndLeavesOutTheErased) {
  // Half of what was seen is gone; each landmark left was absorbed by a new one in its place.
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    if (!scene_.map.landmarks().contains(seen_[i].landmark)) continue;
    if (i % 2 == 0) {
      scene_.map.erase_landmark(seen_[i].landmark);
      continue;
    }
    const Landmark old = scene_.map.landmarks().at(seen_[i].landmark);
    const LandmarkId survivor =
        scene_.map.add_landmark(scene_.submap, old.position_in_world, old.reference);
    scene_.map.merge_landmarks(survivor, seen_[i].landmark);
  }
  const auto refined = refiner_.refine(*scene_.rig, scene_.map, seen_, stale_);
  ASSERT_TRUE(refined);
  EXPECT_LT(error_m(*refined), 0.015);
}

TEST_P(PoseRefinerTest, GivesNothingWhereTooLittleIsLeftOrAgrees) {
  std::vector<SeenLandmark> few(seen_.begin(), seen_.begin() + 10);
  EXPECT_FALSE(refiner_.refine(*scene_.rig, scene_.map, few, stale_));
  std::vector<SeenLandmark> wrong = seen_;
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    wrong[i].landmark = seen_[(i + seen_.size() / 2) % seen_.size()].landmark;
  }
  EXPECT_FALSE(refiner_.refine(*scene_.rig, scene_.map, wrong, stale_));
}

TEST_P(PoseRefinerTest, FindsWhatAFrameSeesOfAKeyframe) {
  const auto found = refiner_.find(*scene_.rig, scene_.map, KeyframeId{1}, *view_.features, stale_);
  ASSERT_GT(found.size(), 150u);
  const auto refined = refiner_.refine(*scene_.rig, scene_.map, found, stale_);
  ASSERT_TRUE(refined);
  EXPECT_LT(error_m(*refined), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Cameras, PoseRefinerTest, ::testing::Values(1, 2));

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_check.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// A keyframe at the origin, and a view from half a metre to the side.
class PoseCheckTest : public ::testing::Test {
 protected:
  PoseCheckTest() : scene_(1, cloud_ahead(), {.seed = 5}, true) {
    keyframe_ = scene_.add_keyframe(pose_at(0.0));
    view_ = scene_.look(truth_, 100);
  }

  double part_in_place(const Rigid3& world_from_rig) {
    const auto alike =
        FrameLocator().find_alike(*view_.features, scene_.map.keyframes().at(keyframe_));
    EXPECT_GT(num_valid(alike), 100);
    return waymark::part_in_place(*view_.features, scene_.map, alike, world_from_rig.inverse());
  }

  const Rigid3 truth_ = pose_at(0.5);
  TestMap scene_;
  KeyframeId keyframe_;
  PointObservation view_;
};

TEST_F(PoseCheckTest, WhatLooksAlikeIsInPlaceAtTheTruePoseAlone) {
  EXPECT_GT(part_in_place(truth_), 0.95);
  EXPECT_LT(part_in_place(pose_at(0.0)), 0.1);
  EXPECT_LT(part_in_place(pose_at(0.5, 0.0, 0.0, 0.2)), 0.1);
}

TEST_F(PoseCheckTest, NothingAlikeContradictsNothing) {
  const std::vector<LandmarkId> none(view_.features->size());
  EXPECT_EQ(waymark::part_in_place(*view_.features, scene_.map, none, Rigid3()), 1.0);
}

TEST_F(PoseCheckTest, DistancesAreTurnsAndPartsOfTheDepth) {
  LocatedFrame located;
  located.landmarks = scene_.true_associations(view_);
  located.rig_from_world = truth_.inverse();
  EXPECT_NEAR(distance_from(truth_.inverse(), scene_.map, located), 0.0, 1e-6);
  // The cloud is 4 to 9 m away.
  const double way = distance_from(pose_at(-0.5).inverse(), scene_.map, located);
  EXPECT_GT(way, 1.0 / 9.0);
  EXPECT_LT(way, 1.0 / 4.0);
  const double turned = distance_from(pose_at(0.5, 0.0, 0.0, 0.2).inverse(), scene_.map, located);
  EXPECT_NEAR(turned, 0.2, 1e-6);
}

/// Located at a pose by all that is seen from the true one.
LocatedFrame located_at(const TestMap& scene,
                        const PointObservation& view,
                        const Rigid3& world_from_rig) {
  LocatedFrame located;
  located.rig_from_world = world_from_rig.inverse();
  located.landmarks = scene.true_associations(view);
  located.num_inliers = located.num_matches = num_valid(located.landmarks);
  return located;
}

TEST_F(PoseCheckTest, VerifiesByTheMotionElseWhatLooksAlikeElseTwoSearches) {
  PoseCheck check;
  FrameLocator locator;
  const auto is_verified = [&](const Rigid3& world_from_rig) {
    const LocatedFrame located = located_at(scene_, view_, world_from_rig);
    return check.is_verified(*view_.features, scene_.map, located, locator);
  };
  const Rigid3 wrong = pose_at(-1.2);
  check.begin(pose_at(-1.3).inverse());
  EXPECT_TRUE(is_verified(wrong)) << "where the motion led";
  EXPECT_FALSE(check.refusal());
  for (const auto& predicted : {std::optional(Rigid3()), std::optional<Rigid3>()}) {
    check.begin(predicted);
    EXPECT_FALSE(is_verified(wrong));
    ASSERT_TRUE(check.refusal());
    EXPECT_EQ(check.refusal()->reason, FrameReason::kNotVerified);
    EXPECT_GT(check.refusal()->num_inliers, 100);
    EXPECT_FALSE(is_verified(pose_at(-2.0)));
    EXPECT_TRUE(is_verified(pose_at(-1.95))) << "where another search ended, too";
    EXPECT_TRUE(is_verified(truth_));
  }
}

}  // namespace
}  // namespace waymark

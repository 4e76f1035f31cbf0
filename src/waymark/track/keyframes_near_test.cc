// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframes_near.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// Keyframes side by side, some of which look away from the cloud to the left and right.
class KeyframesNear : public ::testing::Test {
 protected:
  KeyframesNear() : scene_(1, scatter_in({-9, -3, 4}, {9, 3, 9}, 3000, 6.0, 3), {}, false) {
    for (const double yaw : {-0.7, 0.0, 0.7}) {
      for (const double x : {-3.0, 0.0, 3.0}) scene_.add_keyframe(pose_at(x, 0.0, 0.0, yaw));
    }
  }

  std::vector<KeyframeId> find(const Rigid3& world_from_rig, std::size_t max_count) const {
    return keyframes_near(
        scene_.map, scene_.submap, *scene_.rig, world_from_rig.inverse(), max_count);
  }

  TestMap scene_;
};

TEST_F(KeyframesNear, PrefersThoseThatLookTheSameWay) {
  EXPECT_EQ(find(pose_at(0.1, 0.0, 0.0, 0.65), 1).at(0), KeyframeId{7});
  EXPECT_EQ(find(pose_at(0.1, 0.0, 0.0, -0.65), 1).at(0), KeyframeId{1});
  EXPECT_EQ(find(pose_at(3.1), 1).at(0), KeyframeId{5});
}

TEST_F(KeyframesNear, LeavesOutThoseThatShareNothing) {
  EXPECT_GT(find(pose_at(0.0), 9).size(), 2u);
  EXPECT_LE(find(pose_at(0.0), 2).size(), 2u);
  EXPECT_TRUE(find(pose_at(0.0, 0.0, 0.0, 3.1), 9).empty());
}

TEST_F(KeyframesNear, KeepsToTheSubmap) {
  scene_.submap = scene_.map.add_submap(false);
  EXPECT_TRUE(find(pose_at(0.0), 9).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/predicted_ids.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

TEST(PredictedIds, AreConsecutiveOverSubmaps) {
  PredictedIds ids;
  EXPECT_EQ(ids.add_submap(2, FrameId{0}), SubmapId{0});
  EXPECT_EQ(ids.newest_keyframe(), KeyframeId{1});
  EXPECT_EQ(ids.add_keyframe(FrameId{0}), KeyframeId{2});
  EXPECT_EQ(ids.add_submap(1, FrameId{0}), SubmapId{1});
  EXPECT_EQ(ids.submap_start(), KeyframeId{3});
  EXPECT_EQ(ids.newest_keyframe(), KeyframeId{3});
}

TEST(PredictedIds, GoOnFromAMapAndKnowWhatItLacks) {
  TestMap scene(1, cloud_ahead(), {}, false);
  for (const double x : {0.0, 0.1, 0.2}) scene.add_keyframe(pose_at(x));
  scene.map.erase_keyframe(KeyframeId{1});
  PredictedIds ids(scene.map);
  EXPECT_EQ(ids.num_pending(scene.map), 0u);
  EXPECT_EQ(ids.submap_age(scene.map), 3u) << "one that is gone counts, too";
  EXPECT_EQ(ids.add_keyframe(FrameId{0}), KeyframeId{3});
  EXPECT_EQ(ids.add_submap(2, FrameId{0}), SubmapId{1});
  EXPECT_EQ(ids.num_pending(scene.map), 3u);
}

}  // namespace
}  // namespace waymark

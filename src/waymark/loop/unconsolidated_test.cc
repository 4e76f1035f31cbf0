// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/unconsolidated.h"

#include <gtest/gtest.h>

#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

TEST(Unconsolidated, GivesTheNewestFirstAndEachOnce) {
  LoopScene scene(cloud_all_round(200), true, Vector7d::Zero());
  Unconsolidated unconsolidated;
  EXPECT_FALSE(unconsolidated.take(scene.map));
  for (int step = 0; step < 4; ++step) scene.add_keyframe(step);
  unconsolidated.add({}, scene.map);  // What came since the last time.
  scene.map.erase_keyframe(KeyframeId{2});
  EXPECT_EQ(unconsolidated.take(scene.map), KeyframeId{3});
  EXPECT_EQ(unconsolidated.take(scene.map), KeyframeId{1}) << "keyframe 2 is gone";
  scene.add_keyframe(4);
  const KeyframeId moved[] = {KeyframeId{1}};
  unconsolidated.add(moved, scene.map);
  for (const std::uint32_t id : {4u, 1u, 0u}) {
    EXPECT_EQ(unconsolidated.take(scene.map), KeyframeId{id});
  }
  EXPECT_FALSE(unconsolidated.take(scene.map));
}

}  // namespace
}  // namespace waymark

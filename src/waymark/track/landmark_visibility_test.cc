// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/landmark_visibility.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(VisibilityCounter, AddsUpPerLandmarkInOrder) {
  VisibilityCounter counter;
  for (int frame = 0; frame < 3; ++frame) {
    counter.count_visible(LandmarkId{7});
    counter.count_visible(LandmarkId{2});
    if (frame == 1) counter.count_found(LandmarkId{7});
  }
  const std::vector<LandmarkVisibility> counts = counter.take();
  ASSERT_EQ(counts.size(), 2u);
  EXPECT_EQ(counts[0].landmark, LandmarkId{2});
  EXPECT_EQ(counts[0].num_visible, 3u);
  EXPECT_EQ(counts[0].num_found, 0u);
  EXPECT_EQ(counts[1].landmark, LandmarkId{7});
  EXPECT_EQ(counts[1].num_visible, 3u);
  EXPECT_EQ(counts[1].num_found, 1u);
}

TEST(VisibilityCounter, GivesEachCountOnce) {
  VisibilityCounter counter;
  counter.count_found(LandmarkId{1});
  EXPECT_EQ(counter.take().size(), 1u);
  EXPECT_TRUE(counter.take().empty());
  counter.count_found(LandmarkId{1});
  counter.clear();
  EXPECT_TRUE(counter.take().empty());
}

}  // namespace
}  // namespace waymark

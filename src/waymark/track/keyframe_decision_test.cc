// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframe_decision.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

class KeyframeDecision : public ::testing::Test {
 protected:
  bool is_made() const { return should_make_keyframe(situation_, TrackingSettings{}); }

  /// Nothing calls for a keyframe.
  KeyframeSituation situation_{.num_reference = 200,
                               .num_shared = 180,
                               .num_near_untracked = 20,
                               .num_near_tracked = 100,
                               .frames_since_keyframe = 5};
};

TEST_F(KeyframeDecision, NoneWithoutAReason) { EXPECT_FALSE(is_made()); }

TEST_F(KeyframeDecision, WhenLittleOfTheReferenceIsSeen) {
  situation_.num_shared = 91;
  EXPECT_FALSE(is_made());
  situation_.num_shared = 89;
  EXPECT_TRUE(is_made());
}

TEST_F(KeyframeDecision, WhenThereIsParallax) {
  situation_.median_parallax_px = 59.0;
  EXPECT_FALSE(is_made());
  situation_.median_parallax_px = 61.0;
  EXPECT_TRUE(is_made());
}

TEST_F(KeyframeDecision, AfterALongTimeOnlyIfTheCameraMoves) {
  situation_.frames_since_keyframe = 30;
  EXPECT_FALSE(is_made());
  situation_.median_parallax_px = 16.0;
  EXPECT_TRUE(is_made());
  situation_.frames_since_keyframe = 29;
  EXPECT_FALSE(is_made());
}

TEST_F(KeyframeDecision, WhenMostOfWhatIsNearIsNewAndRangeIsMeasured) {
  situation_.num_near_tracked = 5;
  EXPECT_FALSE(is_made());
  situation_.has_range = true;
  EXPECT_TRUE(is_made());
  situation_.num_near_tracked = 0;
  situation_.num_near_untracked = 0;
  EXPECT_FALSE(is_made());
}

TEST_F(KeyframeDecision, NotWhileTheMapperIsBehindOrRightAfterTheLast) {
  situation_.num_shared = 0;
  ASSERT_TRUE(is_made());
  situation_.num_pending = 1;
  EXPECT_TRUE(is_made());
  situation_.num_pending = 2;
  EXPECT_FALSE(is_made());
  situation_.num_pending = 0;
  situation_.frames_since_keyframe = 0;
  EXPECT_FALSE(is_made());
}

}  // namespace
}  // namespace waymark

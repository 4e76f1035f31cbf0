// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframe_decision.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

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
  situation_.num_reference = 100;
  situation_.num_shared = 56;
  EXPECT_FALSE(is_made());
  situation_.num_shared = 54;
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
  situation_.num_pending = 1;  // Is about to make it known.
  EXPECT_FALSE(is_made());
  situation_.num_pending = 0;
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

/// A frame among two keyframes side by side, and what each of its features shows.
class KeyframeAssessment : public ::testing::TestWithParam<int> {
 protected:
  KeyframeAssessment() : scene_(GetParam(), cloud_ahead(), {.seed = 5}, true) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
  }

  KeyframeSituation assess(const Rigid3& world_from_rig, std::uint32_t stride) const {
    const PointObservation view = scene_.look(world_from_rig, 100);
    LocatedFrame located;
    located.rig_from_world = world_from_rig.inverse();
    located.landmarks = scene_.true_associations(view);
    for (std::size_t i = 0; i < view.features->num_primary; ++i) {
      if (i % stride != 0) located.landmarks[i] = LandmarkId{};
    }
    return compare_with_reference(*view.features,
                                  GetParam() == 2,
                                  located,
                                  scene_.map,
                                  view_of(scene_.map.keyframes().at(KeyframeId{1})),
                                  2);
  }

  TestMap scene_;
};

TEST_P(KeyframeAssessment, CountsWhatIsSharedWithTheReference) {
  const KeyframeSituation all = assess(pose_at(0.4), 1);
  const KeyframeSituation half = assess(pose_at(0.4), 2);
  // Only what both keyframes see is established.
  EXPECT_LT(all.num_reference, static_cast<int>(scene_.seen[1].features->num_primary));
  EXPECT_GT(all.num_shared, all.num_reference * 8 / 10);
  EXPECT_LE(all.num_shared, all.num_reference);
  EXPECT_NEAR(half.num_shared, all.num_shared / 2, all.num_shared / 10);
}

TEST_P(KeyframeAssessment, ComparesWithAKeyframeOnItsWay) {
  const PointObservation sent = scene_.look(pose_at(0.6), 100);
  const std::vector<LandmarkId> landmarks = scene_.true_associations(sent);
  LocatedFrame located;
  located.rig_from_world = pose_at(0.6).inverse();
  located.landmarks = landmarks;
  const KeyframeView view = view_of(*sent.features, landmarks, located.rig_from_world);
  const KeyframeSituation again =
      compare_with_reference(*sent.features, GetParam() == 2, located, scene_.map, view, 2);
  EXPECT_GT(again.num_reference, 50);
  EXPECT_EQ(again.num_shared, again.num_reference);
  EXPECT_LT(again.median_parallax_px, 1e-6);
}

TEST_P(KeyframeAssessment, MeasuresParallaxInPixels) {
  EXPECT_LT(assess(pose_at(0.5), 1).median_parallax_px, 1e-6);
  const double once = assess(pose_at(0.6), 1).median_parallax_px;
  EXPECT_GT(once, 2.0);
  EXPECT_NEAR(assess(pose_at(0.7), 1).median_parallax_px, 2.0 * once, 0.2 * once);
}

TEST_P(KeyframeAssessment, CountsNearFeaturesWhereRangeIsMeasured) {
  const KeyframeSituation third = assess(pose_at(0.4), 3);
  const int num_near = third.num_near_tracked + third.num_near_untracked;
  if (GetParam() == 1) {
    EXPECT_EQ(num_near, 0);
    return;
  }
  EXPECT_GT(num_near, 50);
  EXPECT_GT(third.num_near_untracked, third.num_near_tracked);
}

INSTANTIATE_TEST_SUITE_P(Cameras,
                         KeyframeAssessment,
                         ::testing::Values(1, 2),
                         [](const auto& info) { return info.param == 1 ? "mono" : "stereo"; });

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/cull.h"

#include <gtest/gtest.h>

#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

/// Keyframes on a line that all see the same landmarks, feature i seeing landmark i.
class Cull : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kNumKeyframes = 8;
  static constexpr std::uint32_t kNumFeatures = 40;

  Cull() {
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    features->num_primary = kNumFeatures;
    features->keypoints.resize(kNumFeatures);
    features->descriptors.resize(kNumFeatures);
    features->bearings.assign(kNumFeatures, Eigen::Vector3f::UnitZ());
    features->level_pixel_from_bearing.assign(kNumFeatures, Matrix23f::Zero());
    features->size_rad.assign(kNumFeatures, 0.002f);
    features->partner.assign(kNumFeatures, kNoFeature);
    features->range_m.assign(kNumFeatures, 0.0f);
    features->inverse_range_sigma.assign(kNumFeatures, 0.0f);
    const SubmapId submap = map_.add_submap(false);
    for (std::uint32_t k = 0; k < kNumKeyframes; ++k) {
      Keyframe keyframe;
      keyframe.frame = FrameId{k};
      keyframe.submap = submap;
      keyframe.rig_from_world.translation.x() = -0.1 * k;
      if (k > 0) keyframe.parent = KeyframeId{k - 1};
      keyframe.features = features;
      map_.add_keyframe(std::move(keyframe));
    }
    for (std::uint32_t i = 0; i < kNumFeatures; ++i) {
      landmarks_.push_back(map_.add_landmark(submap, {0.1 * i, 0.0, 4.0}, KeyframeId{0}));
    }
  }

  void observe_all(std::uint32_t keyframe) {
    for (std::uint32_t i = 0; i < kNumFeatures; ++i) {
      map_.observe(KeyframeId{keyframe}, i, landmarks_[i]);
    }
  }

  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  Map map_;
  std::vector<LandmarkId> landmarks_;
  DirtyLandmarks dirty_;
};

TEST_F(Cull, ErasesRedundantKeyframesButNeitherTheRootNorTheNewest) {
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) observe_all(k);
  const Rigid3 rig_from_keyframe(Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.5});
  std::vector<Rigid3> before;
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) {
    before.push_back(map_.rig_from_world(KeyframeId{k}, rig_from_keyframe, 1.0));
  }
  cull_redundant_keyframes(map_, KeyframeId{kNumKeyframes - 1}, dirty_);
  EXPECT_EQ(map_.broken_invariants(), "");
  EXPECT_EQ(map_.keyframes().size(), 4u);
  for (const std::uint32_t k : {0u, 5u, 6u, 7u}) {
    EXPECT_TRUE(map_.keyframes().contains(KeyframeId{k})) << k;
  }
  EXPECT_EQ(map_.landmarks().size(), kNumFeatures);
  EXPECT_EQ(dirty_.size(), kNumFeatures);
  // Poses stored relative to an erased keyframe stay where they were.
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) {
    EXPECT_TRUE(map_.keyframes().contains(map_.resolve(KeyframeId{k})));
    EXPECT_TRUE(map_.rig_from_world(KeyframeId{k}, rig_from_keyframe, 1.0)
                    .matrix()
                    .isApprox(before[k].matrix(), 1e-12));
  }
}

TEST_F(Cull, KeepsKeyframesThatSeeWhatFewOthersSee) {
  for (const std::uint32_t k : {0u, 2u, 7u}) observe_all(k);
  cull_redundant_keyframes(map_, KeyframeId{7}, dirty_);
  EXPECT_EQ(map_.keyframes().size(), kNumKeyframes);
  EXPECT_TRUE(dirty_.empty());
}

TEST_F(Cull, ProbationErasesWhatIsRarelyFound) {
  for (std::uint32_t k = 0; k < 4; ++k) observe_all(k);
  RecentLandmarks recent_landmarks;
  recent_landmarks.add(landmarks_[0], 4);
  recent_landmarks.add(landmarks_[1], 4);
  map_.count_visibility(landmarks_[0], 20, 4);
  map_.count_visibility(landmarks_[1], 20, 5);
  recent_landmarks.review(map_, 5, dirty_);
  EXPECT_FALSE(map_.landmarks().contains(landmarks_[0]));
  EXPECT_TRUE(map_.landmarks().contains(landmarks_[1]));
  EXPECT_EQ(map_.broken_invariants(), "");
}

TEST_F(Cull, ProbationErasesWhatTooFewKeyframesSawInTime) {
  for (std::uint32_t k = 0; k < 3; ++k) map_.observe(KeyframeId{k}, 0, landmarks_[0]);
  for (std::uint32_t k = 0; k < 2; ++k) map_.observe(KeyframeId{k}, 1, landmarks_[1]);
  RecentLandmarks recent_landmarks;
  recent_landmarks.add(landmarks_[0], 1);
  recent_landmarks.add(landmarks_[1], 1);
  recent_landmarks.review(map_, 2, dirty_);
  EXPECT_TRUE(map_.landmarks().contains(landmarks_[1])) << "too early to tell";
  recent_landmarks.review(map_, 3, dirty_);
  EXPECT_TRUE(map_.landmarks().contains(landmarks_[0]));
  EXPECT_FALSE(map_.landmarks().contains(landmarks_[1]));
}

TEST_F(Cull, ProbationEndsForThoseThatStoodTheTest) {
  for (std::uint32_t k = 0; k < 3; ++k) map_.observe(KeyframeId{k}, 0, landmarks_[0]);
  RecentLandmarks recent_landmarks;
  recent_landmarks.add(landmarks_[0], 1);
  recent_landmarks.review(map_, 4, dirty_);
  map_.count_visibility(landmarks_[0], 100, 0);
  recent_landmarks.review(map_, 5, dirty_);
  EXPECT_TRUE(map_.landmarks().contains(landmarks_[0]));
}

}  // namespace
}  // namespace waymark

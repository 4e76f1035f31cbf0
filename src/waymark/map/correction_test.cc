// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/correction.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// Keyframes 0 to 4 in a row, each the child of the one before, 1 m apart along x and looking along
/// z, one landmark each, 2 m ahead.
class CorrectionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto features = std::make_shared<Features>();
    features->rig = std::make_shared<Rig>();
    features->keypoints.resize(2);
    features->num_primary = 2;
    features->partner.assign(2, kNoFeature);
    const SubmapId submap = map_.add_submap(false);
    for (int i = 0; i < 5; ++i) {
      Keyframe keyframe;
      keyframe.submap = submap;
      if (i > 0) keyframe.parent = KeyframeId{static_cast<std::uint32_t>(i - 1)};
      keyframe.features = features;
      keyframe.rig_from_world.translation = {-static_cast<double>(i), 0.0, 0.0};
      const KeyframeId id = map_.add_keyframe(keyframe);
      const LandmarkId landmark = map_.add_landmark(submap, {static_cast<double>(i), 0.0, 2.0}, id);
      map_.observe(id, 0, landmark);
      map_.set_appearance(landmark, {{}, -Eigen::Vector3d::UnitZ(), 0.01});
    }
  }

  Eigen::Vector3d landmark_in_rig(std::uint32_t landmark, std::uint32_t keyframe) const {
    return map_.keyframes().at(KeyframeId{keyframe}).rig_from_world *
           map_.landmarks().at(LandmarkId{landmark}).position_in_world;
  }

  Map map_;
  const Rigid3 target_ = Rigid3::exp((Vector6d() << 0.3, -0.2, 0.5, 0.1, 0.4, -0.2).finished());
};

TEST_F(CorrectionTest, OfAPartMovesOnlyWhatItNamesAndItsLandmarks) {
  MapCorrection correction;
  correction.is_of_part = true;
  correction.keyframes.push_back({KeyframeId{2}, target_, 1.5});
  correction.landmarks.push_back({LandmarkId{4}, {7.0, 8.0, 9.0}});
  apply_correction(map_, correction);
  EXPECT_EQ(map_.broken_invariants(), "");
  EXPECT_EQ(map_.keyframes().at(KeyframeId{2}).rig_from_world.translation, target_.translation);
  EXPECT_TRUE(landmark_in_rig(2, 2).isApprox(Eigen::Vector3d(0.0, 0.0, 3.0), 1e-12));
  EXPECT_EQ(map_.keyframes().at(KeyframeId{3}).rig_from_world.translation.x(), -3.0);
  EXPECT_EQ(map_.keyframes().at(KeyframeId{3}).applied_scale, 1.0);
  EXPECT_EQ(map_.landmarks().at(LandmarkId{3}).position_in_world, Eigen::Vector3d(3.0, 0.0, 2.0));
  EXPECT_EQ(map_.landmarks().at(LandmarkId{4}).position_in_world, Eigen::Vector3d(7.0, 8.0, 9.0));
}

TEST_F(CorrectionTest, WhatWasUnknownMovesWithTheSimilarityOfItsAncestor) {
  MapCorrection correction;
  correction.keyframes.push_back({KeyframeId{2}, target_, 1.5});
  apply_correction(map_, correction);
  EXPECT_EQ(map_.broken_invariants(), "");
  // Older than what is named: stays.
  EXPECT_EQ(map_.keyframes().at(KeyframeId{1}).rig_from_world.translation.x(), -1.0);
  EXPECT_EQ(map_.keyframes().at(KeyframeId{1}).applied_scale, 1.0);
  EXPECT_EQ(map_.landmarks().at(LandmarkId{1}).position_in_world, Eigen::Vector3d(1.0, 0.0, 2.0));
  // Named: exactly where told, with its landmark at the scaled distance.
  EXPECT_EQ(map_.keyframes().at(KeyframeId{2}).rig_from_world.translation, target_.translation);
  EXPECT_EQ(map_.keyframes().at(KeyframeId{2}).applied_scale, 1.5);
  EXPECT_TRUE(landmark_in_rig(2, 2).isApprox(Eigen::Vector3d(0.0, 0.0, 3.0), 1e-12));
  const Appearance& appearance = map_.landmarks().at(LandmarkId{2}).appearance;
  EXPECT_DOUBLE_EQ(appearance.size_m, 0.015);
  EXPECT_TRUE((target_.rotation * appearance.direction).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12));
  // Younger: the same picture, 1.5 times as large.
  EXPECT_EQ(map_.keyframes().at(KeyframeId{4}).applied_scale, 1.5);
  EXPECT_TRUE(landmark_in_rig(4, 2).isApprox(Eigen::Vector3d(3.0, 0.0, 3.0), 1e-12));
  EXPECT_TRUE(landmark_in_rig(3, 4).isApprox(Eigen::Vector3d(-1.5, 0.0, 3.0), 1e-12));
}

TEST_F(CorrectionTest, NamedLandmarksGoWhereTheyAreTold) {
  MapCorrection correction;
  correction.keyframes.push_back({KeyframeId{0}, target_, 1.0});
  correction.landmarks.push_back({LandmarkId{3}, {7.0, 8.0, 9.0}});
  apply_correction(map_, correction);
  EXPECT_EQ(map_.landmarks().at(LandmarkId{3}).position_in_world, Eigen::Vector3d(7.0, 8.0, 9.0));
  EXPECT_TRUE(landmark_in_rig(4, 0).isApprox(Eigen::Vector3d(4.0, 0.0, 2.0), 1e-12));
}

TEST_F(CorrectionTest, StoredRelativePosesAreRescaledAlsoThroughErasedReferences) {
  // A frame half a metre ahead of keyframe 3, stored before the correction.
  const Rigid3 rig_from_reference(Eigen::Quaterniond::Identity(), {0.0, 0.0, -0.5});
  const auto seen_from = [&](KeyframeId reference) {
    return map_.rig_from_world(reference, rig_from_reference, 1.0) *
           map_.landmarks().at(LandmarkId{3}).position_in_world;
  };
  MapCorrection correction;
  correction.keyframes.push_back({KeyframeId{2}, target_, 1.5});
  map_.observe(KeyframeId{4}, 1, LandmarkId{3});  // Outlives its keyframe.
  apply_correction(map_, correction);
  EXPECT_TRUE(seen_from(KeyframeId{3}).isApprox(Eigen::Vector3d(0.0, 0.0, 2.25), 1e-12));
  map_.erase_keyframe(KeyframeId{3});
  EXPECT_TRUE(seen_from(KeyframeId{3}).isApprox(Eigen::Vector3d(0.0, 0.0, 2.25), 1e-12));
  correction.keyframes.front().scale = 2.0;
  apply_correction(map_, correction);
  EXPECT_TRUE(seen_from(KeyframeId{3}).isApprox(Eigen::Vector3d(0.0, 0.0, 4.5), 1e-12));
  EXPECT_DOUBLE_EQ(map_.scale_since(KeyframeId{3}, 1.0), 3.0);
}

TEST_F(CorrectionTest, ErasedElementsAreSkipped) {
  map_.erase_keyframe(KeyframeId{3});
  MapCorrection correction;
  correction.keyframes.push_back({KeyframeId{3}, target_, 2.0});
  correction.landmarks.push_back({LandmarkId{3}, Eigen::Vector3d::Zero()});
  apply_correction(map_, correction);
  EXPECT_EQ(map_.broken_invariants(), "");
  EXPECT_EQ(map_.keyframes().at(KeyframeId{4}).applied_scale, 1.0);
}

TEST_F(CorrectionTest, LoopEdgesFollowTheScales) {
  const Sim3 measured(Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.0}, 1.5);
  map_.add_loop_edge({KeyframeId{0}, KeyframeId{4}, measured});
  MapCorrection correction;
  correction.keyframes.push_back({KeyframeId{2}, target_, 1.0 / 1.5});
  apply_correction(map_, correction);
  const LoopEdge edge = map_.loop_edges().front();
  EXPECT_NEAR(edge.to_from_from.scale, 1.0, 1e-12);
  EXPECT_NEAR(edge.to_from_from.translation.z(), 1.0 / 1.5, 1e-12);
  EXPECT_TRUE(map_.has_loop_edge(KeyframeId{4}));
  EXPECT_FALSE(map_.has_loop_edge(KeyframeId{2}));
}

TEST_F(CorrectionTest, JoinedSubmapsShareOneTree) {
  const SubmapId other = map_.add_submap(false);
  KeyframeId parent;
  for (int i = 0; i < 3; ++i) {
    Keyframe keyframe = map_.keyframes().at(KeyframeId{0});
    keyframe.submap = other;
    keyframe.parent = parent;
    parent = map_.add_keyframe(keyframe);
  }
  const LandmarkId landmark = map_.add_landmark(other, Eigen::Vector3d::Ones(), KeyframeId{6});
  map_.observe(KeyframeId{6}, 1, landmark);
  map_.join_submaps(KeyframeId{7}, KeyframeId{1});
  EXPECT_EQ(map_.broken_invariants(), "");
  EXPECT_EQ(map_.resolve(other), SubmapId{0});
  EXPECT_EQ(map_.keyframes().at(KeyframeId{7}).parent, KeyframeId{1});
  EXPECT_EQ(map_.keyframes().at(KeyframeId{5}).parent, KeyframeId{6});
  EXPECT_EQ(map_.keyframes().at(KeyframeId{5}).submap, SubmapId{0});
  EXPECT_EQ(map_.landmarks().at(landmark).submap, SubmapId{0});
}

}  // namespace
}  // namespace waymark

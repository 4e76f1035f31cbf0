// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/associate.h"

#include <gtest/gtest.h>

#include "waymark/features/range_precision.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// The first primary feature that shows a point of the cloud, with a partner if asked for.
std::uint32_t some_feature(const PointObservation& view, bool has_partner) {
  for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
    if (view.landmark_of_feature[i] == kNoLandmark) continue;
    if (!has_partner || view.features->partner[i] != kNoFeature) return i;
  }
  ADD_FAILURE() << "no such feature";
  return 0;
}

class AssociateTest : public ::testing::Test {
 protected:
  AssociateTest() : scene_(2, cloud_ahead(), {.seed = 8, .pixel_sigma = 0.0}, true) {
    id_ = scene_.add_bare_keyframe(pose_at(0.2, 0.1, 0.0, 0.05));
    feature_ = some_feature(scene_.seen[0], true);
    partner_ = scene_.seen[0].features->partner[feature_];
    point_ = scene_.cloud.landmarks[scene_.seen[0].landmark_of_feature[feature_]].position;
  }

  const Keyframe& keyframe() const { return scene_.map.keyframes().at(id_); }

  TestMap scene_;
  KeyframeId id_;
  std::uint32_t feature_ = 0;
  std::uint32_t partner_ = 0;
  Eigen::Vector3d point_;
};

TEST_F(AssociateTest, ResidualIsInPixelsOfTheLevelInEitherCamera) {
  for (const std::uint32_t feature : {feature_, partner_}) {
    ASSERT_TRUE(squared_residual(keyframe(), feature, point_));
    EXPECT_LT(*squared_residual(keyframe(), feature, point_), 1e-6);
    EXPECT_TRUE(agrees(keyframe(), feature, point_));
    // So far to the side that it looks three pixels of the level away.
    const Features& features = *keyframe().features;
    const Rigid3 world_from_rig = keyframe().rig_from_world.inverse();
    const double distance = (point_ - world_from_rig.translation).norm();
    const Eigen::Vector3d beside =
        point_ + 3.0 * features.size_rad[feature] * distance *
                     (world_from_rig.rotation * Eigen::Vector3d::UnitY());
    ASSERT_TRUE(squared_residual(keyframe(), feature, beside));
    EXPECT_NEAR(std::sqrt(*squared_residual(keyframe(), feature, beside)), 3.0, 0.6);
    EXPECT_FALSE(agrees(keyframe(), feature, beside));
  }
}

TEST_F(AssociateTest, APointBehindHasNoResidual) {
  const Eigen::Vector3d centre = keyframe().rig_from_world.origin_in_source();
  const Eigen::Vector3d behind = centre - (point_ - centre);
  EXPECT_FALSE(squared_residual(keyframe(), feature_, behind));
  EXPECT_FALSE(agrees(keyframe(), feature_, behind));
}

TEST_F(AssociateTest, ReliableRangesWithoutALandmarkMakeOne) {
  const LandmarkId present = scene_.map.add_landmark(scene_.submap, point_, id_);
  scene_.map.observe(id_, feature_, present);
  DirtyLandmarks dirty;
  const int num_added = add_landmarks_from_range(scene_.map, id_, dirty);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
  EXPECT_GT(num_added, 50);
  EXPECT_EQ(dirty.size(), static_cast<std::size_t>(num_added));
  EXPECT_EQ(keyframe().landmarks[feature_], present);
  int num_expected = 0;
  for (std::uint32_t i = 0; i < keyframe().features->num_primary; ++i) {
    const bool is_reliable = has_reliable_range(*keyframe().features, i);
    if (i == feature_) continue;
    num_expected += is_reliable;
    ASSERT_EQ(keyframe().landmarks[i].is_valid(), is_reliable) << i;
    if (!is_reliable) continue;
    const Landmark& landmark = scene_.map.landmarks().at(keyframe().landmarks[i]);
    const std::uint32_t index = scene_.seen[0].landmark_of_feature[i];
    EXPECT_LT((landmark.position_in_world - scene_.cloud.landmarks[index].position).norm(), 0.01);
  }
  EXPECT_EQ(num_added, num_expected);
  EXPECT_EQ(add_landmarks_from_range(scene_.map, id_, dirty), 0);
}

TEST(StrongestNeighbours, ComeInOrderOfWhatTheyShare) {
  TestMap scene(1, cloud_ahead(), {.seed = 8}, false);
  scene.add_keyframe(pose_at(0.0));
  for (const std::uint32_t stride : {4u, 1u, 2u, 8u}) scene.add_keyframe(pose_at(0.01), stride);
  const auto ids = strongest_neighbours(scene.map, KeyframeId{0}, 3);
  EXPECT_EQ(ids, (std::vector<KeyframeId>{KeyframeId{2}, KeyframeId{3}, KeyframeId{1}}));
  EXPECT_EQ(strongest_neighbours(scene.map, KeyframeId{0}, 10).size(), 4u);
}

}  // namespace
}  // namespace waymark

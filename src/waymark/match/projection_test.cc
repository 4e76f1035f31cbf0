// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/projection.h"

#include <gtest/gtest.h>

#include <set>

#include "waymark/features/feature_geometry.h"
#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

class Projection : public ::testing::Test {
 protected:
  Projection() {
    PointNoise noise;
    noise.max_features = 3000;
    noise.outlier_share = 0.1;
    seen_ = observe(cloud_, rig_, world_from_rig_, noise, 1);
  }

  int num_true_features() const {
    int count = 0;
    for (std::size_t i = 0; i < seen_.features->num_primary; ++i) {
      count += seen_.landmark_of_feature[i] != kNoLandmark;
    }
    return count;
  }

  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  const PointCloud cloud_ = scatter_in({-4.0, -3.0, 2.0}, {4.0, 3.0, 7.0}, 1500, 4.0, 3);
  const Rigid3 world_from_rig_ = make_test_pose({0.2, -0.1, -0.4}, {0.05, -0.1, 0.2});
  const LandmarkSet landmarks_ = true_landmarks(cloud_, world_from_rig_.translation);
  PointObservation seen_;
  ProjectionMatcher matcher_;
};

TEST_F(Projection, FindsLandmarksAtTheTruePose) {
  const auto& matches =
      matcher_.match(*rig_, landmarks_, *seen_.features, {}, world_from_rig_.inverse(), {});
  int num_right = 0;
  int num_wrong = 0;
  std::set<std::uint32_t> used;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (matches.features[i] == kNoFeature) continue;
    (seen_.landmark_of_feature[matches.features[i]] == i ? num_right : num_wrong) += 1;
    EXPECT_TRUE(matches.is_visible[i]);
    EXPECT_TRUE(used.insert(matches.features[i]).second);
  }
  ASSERT_GT(num_true_features(), 200);
  EXPECT_GT(num_right, 0.9 * num_true_features());
  EXPECT_LT(num_wrong, 0.01 * num_true_features());
  EXPECT_EQ(matches.num_matches, used.size());
}

TEST_F(Projection, LeavesTakenFeaturesAlone) {
  std::vector<std::uint8_t> is_taken(seen_.features->num_primary);
  for (std::size_t i = 0; i < is_taken.size(); i += 2) is_taken[i] = 1;
  const auto& matches =
      matcher_.match(*rig_, landmarks_, *seen_.features, is_taken, world_from_rig_.inverse(), {});
  EXPECT_GT(matches.num_matches, 80u);
  for (const std::uint32_t feature : matches.features) {
    if (feature != kNoFeature) {
      EXPECT_FALSE(is_taken[feature]);
    }
  }
}

TEST_F(Projection, OneFeatureServesTheMoreSimilarOfTwoLandmarks) {
  std::uint32_t feature = 0;
  while (seen_.landmark_of_feature[feature] == kNoLandmark) ++feature;
  const std::uint32_t index = seen_.landmark_of_feature[feature];
  for (const bool is_better_first : {true, false}) {
    LandmarkSet twins;
    for (const bool is_better : {is_better_first, !is_better_first}) {
      Landmark landmark;
      landmark.position_in_world = landmarks_.positions_in_world[index];
      landmark.appearance = {seen_.features->descriptors[feature],
                             landmarks_.directions[index],
                             landmarks_.sizes_m[index]};
      if (!is_better) landmark.appearance.descriptor[0] ^= 0xff;
      twins.add(LandmarkId{is_better ? 1u : 0u}, landmark);
    }
    const auto& matches =
        matcher_.match(*rig_, twins, *seen_.features, {}, world_from_rig_.inverse(), {});
    EXPECT_EQ(matches.num_matches, 1u);
    EXPECT_EQ(matches.features[is_better_first ? 0 : 1], feature);
    EXPECT_EQ(matches.features[is_better_first ? 1 : 0], kNoFeature);
  }
}

TEST_F(Projection, DoesNotLookForWhatIsKnownFromTheOtherSideOnly) {
  LandmarkSet behind = landmarks_;
  for (Vector3d& direction : behind.directions) direction = -direction;
  const auto& matches =
      matcher_.match(*rig_, behind, *seen_.features, {}, world_from_rig_.inverse(), {});
  EXPECT_EQ(matches.num_matches, 0u);
  for (const std::uint8_t is_visible : matches.is_visible) EXPECT_FALSE(is_visible);
}

TEST_F(Projection, DoesNotMatchOtherSizes) {
  LandmarkSet large = landmarks_;
  for (double& size_m : large.sizes_m) size_m *= 2.5;
  const auto& matches =
      matcher_.match(*rig_, large, *seen_.features, {}, world_from_rig_.inverse(), {});
  EXPECT_LT(static_cast<double>(matches.num_matches), 0.02 * num_true_features());
}

TEST_F(Projection, FindsNothingWhereThePoseIsFarOff) {
  const Rigid3 turned = make_test_pose(Vector3d::Zero(), {0.0, 0.3, 0.0}) * world_from_rig_;
  const auto& matches =
      matcher_.match(*rig_, landmarks_, *seen_.features, {}, turned.inverse(), {});
  EXPECT_LT(static_cast<double>(matches.num_matches), 0.02 * num_true_features());
}

/// A vertical edge at pixel (319.5, 239.5), 2 m away, lighter on its right.
LandmarkSet edge_landmark() {
  Landmark landmark;
  landmark.position_in_world = {0.0, 0.0, 2.0};
  landmark.appearance = {{}, -Vector3d::UnitZ(), 2.0 / 420.0, Vector3d::UnitX()};
  LandmarkSet set;
  set.add(LandmarkId{0}, landmark);
  return set;
}

Features edge_features(const Rig& rig, FeatureArray<Keypoint> keypoints) {
  Features features;
  features.num_primary = features.num_edges = keypoints.size();
  features.descriptors.resize(keypoints.size());
  features.keypoints = std::move(keypoints);
  derive_geometry(rig, features);
  return features;
}

TEST_F(Projection, FindsEdgesAcrossThem) {
  const Features features = edge_features(*rig_,
                                          {{.x_px = 320.0f, .y_px = 239.0f, .angle_rad = 3.1f},
                                           {.x_px = 320.5f, .y_px = 252.0f},
                                           {.x_px = 322.5f, .y_px = 244.0f},
                                           {.x_px = 325.5f, .y_px = 239.0f}});
  // Darker on its right, too far along it, and farther across.
  const auto& matches =
      matcher_.match(*rig_, edge_landmark(), features, {}, Rigid3(), {.radius_px = 8.0});
  EXPECT_EQ(matches.features, std::vector{2u});
}

TEST_F(Projection, KeepsCornersOfASet) {
  LandmarkSet set = edge_landmark();
  set.across[0].setZero();
  Landmark edge;
  edge.appearance.across = Eigen::Vector3d::UnitX();
  Landmark corner;
  corner.position_in_world = {1.0, 2.0, 3.0};
  set.add(LandmarkId{7}, edge);
  set.add(LandmarkId{8}, corner);
  set.keep_corners();
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(set.ids[1], LandmarkId{8});
  EXPECT_EQ(set.positions_in_world[1], corner.position_in_world);
  EXPECT_EQ(set.descriptors.size(), 2u);
}

TEST_F(Projection, KeepsEdgesAndCornersApart) {
  Features features = edge_features(*rig_, {{.x_px = 320.0f, .y_px = 239.0f}});
  LandmarkSet corner = edge_landmark();
  corner.across[0].setZero();
  EXPECT_EQ(matcher_.match(*rig_, corner, features, {}, Rigid3(), {}).num_matches, 0u);
  EXPECT_EQ(matcher_.match(*rig_, edge_landmark(), features, {}, Rigid3(), {}).num_matches, 1u);
  features.num_edges = 0;
  const auto& matches = matcher_.match(*rig_, edge_landmark(), features, {}, Rigid3(), {});
  EXPECT_EQ(matches.num_matches, 0u);
  EXPECT_FALSE(matches.is_visible[0]);  // What has no edges does not say that it should be there.
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Search in 360 degree images: across the seam, and towards the poles, where a small turn moves
// pixels by many columns.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/camera/equirectangular.h"
#include "waymark/match/appearance.h"
#include "waymark/match/epipolar.h"
#include "waymark/match/projection.h"
#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

constexpr int kWidth = 1280;
constexpr double kRadPerPx = 2.0 * 3.14159265358979 / kWidth;

class WholeSphere : public ::testing::Test {
 protected:
  PointObservation see(const Rigid3& world_from_rig, std::uint64_t frame) const {
    PointNoise noise;
    noise.max_features = 3000;
    return observe(cloud_, rig_, world_from_rig, noise, frame);
  }

  static std::shared_ptr<const Rig> make_rig() {
    const auto camera = std::make_shared<EquirectangularCamera>(
        EquirectangularModel(kWidth, kWidth / 2), kWidth, kWidth / 2);
    return std::make_shared<const Rig>(Rig{{{camera, Rigid3()}}});
  }

  const std::shared_ptr<const Rig> rig_ = make_rig();
  const PointCloud cloud_ = scatter_in({-5.0, -5.0, -5.0}, {5.0, 5.0, 5.0}, 2500, 8.0, 3);
};

TEST_F(WholeSphere, NearbySearchCrossesTheSeam) {
  const PointObservation a = see(Rigid3(), 0);
  const PointObservation b = see(make_test_pose(Eigen::Vector3d::Zero(), {0.0, 0.15, 0.0}), 1);
  std::vector<Eigen::Vector2f> expected;
  for (std::size_t i = 0; i < a.features->num_primary; ++i) {
    expected.emplace_back(a.features->keypoints[i].x_px, a.features->keypoints[i].y_px);
  }
  AppearanceMatcher matcher;
  int num_across = 0;
  for (const FeatureMatch& match :
       matcher.match_near(*a.features, expected, 60.0, *b.features, AppearanceOptions())) {
    const float moved = b.features->keypoints[match.b].x_px - a.features->keypoints[match.a].x_px;
    if (std::abs(moved) < kWidth / 2) continue;
    ++num_across;
    EXPECT_EQ(a.landmark_of_feature[match.a], b.landmark_of_feature[match.b]);
  }
  EXPECT_GT(num_across, 15);
}

TEST_F(WholeSphere, ProjectionFindsLandmarksAroundThePoles) {
  const PointObservation seen = see(Rigid3(), 0);
  const LandmarkSet landmarks = true_landmarks(cloud_, Eigen::Vector3d::Zero());
  // 10 pixels of turn about each axis.
  ProjectionMatcher matcher;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), {0, 1, 0}, {0, 0, 1}}) {
    const Rigid3 guess = make_test_pose(Eigen::Vector3d::Zero(), 10.0 * kRadPerPx * axis);
    const auto& matches =
        matcher.match(*rig_, landmarks, *seen.features, {}, guess.inverse(), {.radius_px = 15.0});
    int num_polar = 0, num_found = 0;
    for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
      const std::uint32_t landmark = seen.landmark_of_feature[i];
      if (landmark == kNoLandmark || std::abs(seen.features->bearings[i].y()) < 0.9f) continue;
      ++num_polar;
      num_found += matches.features[landmark] == i;
    }
    ASSERT_GT(num_polar, 40);
    EXPECT_GT(num_found, 0.85 * num_polar) << axis.transpose();
  }
}

TEST_F(WholeSphere, EpipolarSearchLooksAllRound) {
  const Rigid3 b_from_a = make_test_pose({0.3, -0.1, 0.4}, {0.3, 2.5, -0.4}).inverse();
  const PointObservation a = see(Rigid3(), 0);
  const PointObservation b = see(b_from_a.inverse(), 1);
  EpipolarMatcher matcher;
  const std::vector<std::uint8_t> free_a(a.features->num_primary), free_b(b.features->num_primary);
  int num_right = 0, num_wrong = 0, num_behind = 0;
  for (const FeatureMatch& match :
       matcher.match(*a.features, free_a, *b.features, free_b, b_from_a, EpipolarOptions())) {
    const bool is_right = a.landmark_of_feature[match.a] == b.landmark_of_feature[match.b];
    (is_right ? num_right : num_wrong) += 1;
    num_behind += is_right && a.features->bearings[match.a].z() < 0.0f;
  }
  EXPECT_GT(num_right, 300);
  EXPECT_GT(num_behind, num_right / 3);
  EXPECT_LT(num_wrong, num_right / 20);
}

}  // namespace
}  // namespace waymark

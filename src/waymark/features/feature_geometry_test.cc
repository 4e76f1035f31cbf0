// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/feature_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/camera/perspective.h"
#include "waymark/features/frame_builder.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/range_precision.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

Rig make_rig() {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({300.0, 300.0}, {159.5, 119.5}, std::vector{-0.1, 0.01, 0.0, 0.0}),
      320,
      240);
  const Rigid3 cam1_from_rig(Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0});
  return {{{camera, Rigid3()}, {camera, cam1_from_rig}}};
}

TEST(FeatureGeometry, IsThatOfFramesFromImages) {
  const PaddedImage texture = testing::make_texture(332, 240, 5);
  const ImageView left{texture.row(0), 320, 240, texture.stride()};
  const ImageView right{texture.row(0) + 12, 320, 240, texture.stride()};
  FrameBuilder builder(make_rig(), {.features = {.count = 300}});
  const auto built = builder.build({.image0 = left, .image1 = right});
  ASSERT_GT(built->size(), built->num_primary);

  Features derived;
  derived.num_primary = built->num_primary;
  derived.keypoints = built->keypoints;
  const std::vector<std::uint8_t> is_valid = derive_geometry(make_rig(), derived);
  EXPECT_EQ(std::count(is_valid.begin(), is_valid.end(), 1), std::ptrdiff_t(built->size()));
  for (std::uint32_t i = 0; i < derived.size(); ++i) {
    const float tolerance = i < derived.num_primary ? 0.0f : 1e-6f;
    const Matrix23f& w = built->level_pixel_from_bearing[i];
    EXPECT_LE((derived.bearings[i] - built->bearings[i]).norm(), tolerance);
    EXPECT_LE((derived.level_pixel_from_bearing[i] - w).norm(), tolerance * w.norm());
    EXPECT_LE(std::abs(derived.size_rad[i] / built->size_rad[i] - 1.0f), tolerance);
  }
  for (std::uint32_t i = 0; i < derived.num_primary; ++i) {
    const Keypoint& keypoint = derived.keypoints[i];
    int num_found = 0;
    derived.grid.visit_near(
        keypoint.x_px, keypoint.y_px, 1.0, [&](std::uint32_t found) { num_found += found == i; });
    EXPECT_EQ(num_found, 1);
  }
}

TEST(FeatureGeometry, TakesPointsInAsItsLastCorners) {
  const PaddedImage texture = testing::make_texture(332, 240, 5);
  const ImageView left{texture.row(0), 320, 240, texture.stride()};
  const ImageView right{texture.row(0) + 12, 320, 240, texture.stride()};
  FrameBuilder builder(make_rig(), {.features = {.count = 300}});
  const auto built = builder.build({.image0 = left, .image1 = right});
  ASSERT_GT(built->size(), built->num_primary);
  const std::vector<Keypoint> keypoints = {{.x_px = 100.0f, .y_px = 50.0f, .level = 4},
                                           {.x_px = 30.0f, .y_px = 200.0f, .level = 4}};
  const Features all = with_points(*built, keypoints, std::vector<Descriptor>{{1, 2, 3, 4}, {}});
  ASSERT_EQ(all.num_corners(), built->num_corners() + 2);
  ASSERT_EQ(all.size(), built->size() + 2);
  const std::size_t first = built->num_corners();
  EXPECT_EQ(all.keypoints[first].x_px, 100.0f);
  EXPECT_EQ(all.descriptors[first], (Descriptor{1, 2, 3, 4}));
  EXPECT_EQ(all.partner[first], kNoFeature);
  EXPECT_EQ(all.inverse_range_sigma[first], 0.0f);
  for (std::size_t i = 0; i < built->num_primary; ++i) {
    const std::size_t now = i < first ? i : i + 2;
    EXPECT_EQ(all.bearings[now], built->bearings[i]);
    EXPECT_EQ(all.range_m[now], built->range_m[i]);
    if (built->partner[i] == kNoFeature) continue;
    EXPECT_EQ(all.partner[all.partner[now]], now);
    EXPECT_EQ(all.keypoints[all.partner[now]].x_px, built->keypoints[built->partner[i]].x_px);
  }
}

TEST(FeatureGeometry, SaysWhichPixelsHaveNoBearing) {
  Features features;
  features.keypoints = {{.x_px = 160.0f, .y_px = 120.0f}, {.x_px = 1e6f, .y_px = 120.0f}};
  features.num_primary = 2;
  EXPECT_EQ(derive_geometry(make_rig(), features), (std::vector<std::uint8_t>{1, 0}));
}

TEST(FeatureGeometry, OfEdgesIsAcross) {
  constexpr float kAngleRad = 0.7f;
  Features features;
  features.keypoints = {{.x_px = 100.0f, .y_px = 150.0f, .angle_rad = kAngleRad, .level = 2},
                        {.x_px = 100.0f, .y_px = 150.0f, .angle_rad = kAngleRad, .level = 2}};
  features.num_primary = 2;
  features.num_edges = 1;
  derive_geometry(make_rig(), features);
  EXPECT_FALSE(features.is_edge(0));
  EXPECT_TRUE(features.is_edge(1));
  const Eigen::Vector2f across(std::cos(kAngleRad), std::sin(kAngleRad));
  const Matrix23f& of_corner = features.level_pixel_from_bearing[0];
  const Matrix23f& of_edge = features.level_pixel_from_bearing[1];
  EXPECT_LT((across.transpose() * (of_edge - kEdgePrecision * of_corner)).norm(), 1e-3f);
  EXPECT_LT((Eigen::RowVector2f(-across.y(), across.x()) * of_edge).norm(), 1e-3f);
  EXPECT_GT(of_edge.norm(), 100.0f);
}

/// A feature that shows a point in both cameras; found in camera 1 beside where that is, in pixels
/// of level 0 along its rows.
Features see_pair(const Rig& rig, const Eigen::Vector3d& point_in_rig, double off_px) {
  Features features;
  features.num_primary = 1;
  features.partner = {1, 0};
  features.range_m = features.inverse_range_sigma = {0.0f};
  for (std::uint8_t c = 0; c < 2; ++c) {
    const Eigen::Vector3d point_in_cam = rig.cameras[c].cam_from_rig * point_in_rig;
    Eigen::Vector2d pixel;
    std::uint8_t is_visible = 0;
    rig.cameras[c].camera->project({&point_in_cam, 1}, {&pixel, 1}, {&is_visible, 1});
    EXPECT_TRUE(is_visible);
    features.keypoints.push_back({.x_px = static_cast<float>(pixel.x() + c * off_px),
                                  .y_px = static_cast<float>(pixel.y()),
                                  .level = 2,
                                  .camera = c});
  }
  derive_geometry(rig, features);
  measure_stereo_ranges(rig, features);
  return features;
}

TEST(FeatureGeometry, RangesOfAPairHaveThePrecisionOfItsParallax) {
  const Rig rig = make_rig();
  const Eigen::Vector3d point(0.4, -0.3, 2.5);
  const Features exact = see_pair(rig, point, 0.0);
  EXPECT_NEAR(exact.range_m[0], point.norm(), 1e-3);
  const double sigma_px = kStereoSigmaPx * Pyramid::scale(2);
  const Features off = see_pair(rig, point, -sigma_px);
  const double change = 1.0 / off.range_m[0] - 1.0 / exact.range_m[0];
  EXPECT_NEAR(change / exact.inverse_range_sigma[0], 1.0, 0.05);
}

TEST(FeatureGeometry, RangesOfWhatIsFarAwayMayLieBeyondInfinity) {
  const Eigen::Vector3d far_away(500.0, 100.0, 2000.0);
  const Features beyond = see_pair(make_rig(), far_away, 1.0);
  EXPECT_LT(beyond.range_m[0], 0.0f);
  EXPECT_GT(beyond.inverse_range_sigma[0], 0.0f);
  EXPECT_FALSE(has_reliable_range(beyond, 0));
  EXPECT_GT(see_pair(make_rig(), far_away, -1.0).range_m[0], 0.0f);
}

TEST(FeatureGeometry, IsMeasuredAnewByAnotherCalibration) {
  const Rig rig = make_rig();
  const Features before = see_pair(rig, {0.4, -0.3, 2.5}, 0.0);
  Rig turned = rig;
  turned.cameras[1].cam_from_rig.rotation =
      Eigen::AngleAxisd(2e-3, Eigen::Vector3d::UnitY()) * rig.cameras[1].cam_from_rig.rotation;
  Features expected = before;
  measure_stereo_ranges(turned, expected);
  const auto anew = recompute(before, std::make_shared<const Rig>(turned), {});
  EXPECT_EQ(anew->range_m, expected.range_m);
  EXPECT_GT(std::abs(anew->range_m[0] / before.range_m[0] - 1.0f), 0.01f);
}

}  // namespace
}  // namespace waymark

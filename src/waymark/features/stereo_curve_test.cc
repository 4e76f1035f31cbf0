// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo_curve.h"

#include <gtest/gtest.h>

#include "waymark/camera/perspective.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

const Rigid3 kCam1FromCam0(so3_exp({0.1, -0.2, 0.05}), {-0.3, 0.05, 0.1});

Rig make_distorted_rig() {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({400.0, 400.0}, {320.0, 240.0}, std::vector<double>{-0.3, 0.1, 0.0, 0.0}),
      640,
      480);
  return {{{camera, Rigid3()}, {camera, kCam1FromCam0}}};
}

TEST(EpipolarRay, AnglesInverseRangesAndDirectionsAgree) {
  const Eigen::Vector3d bearing = Eigen::Vector3d(0.2, -0.1, 1.0).normalized();
  const EpipolarRay ray(kCam1FromCam0, bearing);
  EXPECT_EQ(ray.angle(0.0), 0.0);
  for (const double range : {0.2, 0.5, 3.0, 1000.0}) {
    const double angle = ray.angle(1.0 / range);
    const Eigen::Vector3d point_in_cam1 = kCam1FromCam0 * (range * bearing);
    EXPECT_LT((ray.direction(angle) - point_in_cam1.normalized()).norm(), 1e-12);
    EXPECT_NEAR(ray.inverse_range(angle) * range, 1.0, 1e-9);
    const Eigen::Vector3d numeric =
        (ray.direction(angle + 1e-6) - ray.direction(angle - 1e-6)) / 2e-6;
    EXPECT_LT((ray.direction_derivative(angle) - numeric).norm(), 1e-9);
  }
  EXPECT_LT(ray.inverse_range(-0.01), 0.0);
}

TEST(EpipolarCurves, NodesLieOnTheCurveAndSpanItsRange) {
  const Rig rig = make_distorted_rig();
  EpipolarCurves curves(rig, 0.8);
  const std::vector<Eigen::Vector3f> bearings = {Eigen::Vector3f(0.0f, 0.0f, 1.0f),
                                                 Eigen::Vector3f(0.2f, 0.1f, 1.0f).normalized()};
  const std::vector<float> size_rad = {1.0f / 400.0f, 2.0f / 400.0f};
  curves.compute(bearings, size_rad);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const std::span<const CurveNode> nodes = curves.nodes(i);
    ASSERT_GE(nodes.size(), 2u);
    for (const CurveNode& node : nodes) {
      const std::vector<Eigen::Vector3d> direction = {curves.ray(i).direction(node.angle_rad)};
      std::vector<Eigen::Vector2d> pixel(1);
      std::vector<std::uint8_t> is_visible(1);
      rig.cameras[1].camera->project(direction, pixel, is_visible);
      EXPECT_TRUE(is_visible[0]);
      EXPECT_LT((pixel[0] - node.pixel).norm(), 1e-6);
    }
    EXPECT_NEAR(nodes.front().angle_rad, -EpipolarCurves::kBehindInfinityPx * size_rad[i], 1e-9);
    EXPECT_NEAR(nodes.back().angle_rad, curves.ray(i).angle(1.0 / 0.8), 1e-9);
  }
}

TEST(EpipolarCurves, StopsWhereTheImageEnds) {
  EpipolarCurves curves(make_distorted_rig(), 0.3);
  const std::vector<Eigen::Vector3f> bearings = {Eigen::Vector3f(-0.45f, 0.0f, 1.0f).normalized(),
                                                 Eigen::Vector3f(0.0f, 0.0f, -1.0f)};
  const std::vector<float> size_rad = {1.0f / 400.0f, 1.0f / 400.0f};
  curves.compute(bearings, size_rad);
  ASSERT_GE(curves.nodes(0).size(), 2u);
  for (const CurveNode& node : curves.nodes(0)) EXPECT_GE(node.pixel.x(), -0.5);
  EXPECT_LT(curves.nodes(0).back().angle_rad, curves.ray(0).angle(1.0 / 0.3) - 0.01);
  EXPECT_TRUE(curves.nodes(1).empty());
}

TEST(EpipolarCurves, ThereIsNoneTowardsTheOtherCamera) {
  EpipolarCurves curves(make_distorted_rig(), 0.3);
  const Eigen::Vector3d epipole = kCam1FromCam0.origin_in_source().normalized();
  const std::vector<Eigen::Vector3f> bearings = {epipole.cast<float>()};
  const std::vector<float> size_rad = {1.0f / 400.0f};
  curves.compute(bearings, size_rad);
  EXPECT_TRUE(curves.nodes(0).empty());
}

}  // namespace
}  // namespace waymark

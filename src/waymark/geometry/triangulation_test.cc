// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/bearing.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::disturb;
using testing::random_direction;
using testing::random_pose;
using testing::random_vector;

TEST(Bearing, AngleIsExactForTinyAngles) {
  for (const double angle : {1e-12, 1e-6, 0.3, 2.0, 3.14}) {
    const Eigen::Vector3d turned(std::cos(angle), std::sin(angle), 0.0);
    EXPECT_NEAR(angle_between(Eigen::Vector3d::UnitX(), turned), angle, 1e-15 + 1e-12 * angle);
  }
}

TEST(Bearing, TangentBasisIsOrthonormalEverywhere) {
  Rng rng(1, 0);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = i == 0   ? Eigen::Vector3d(0, 0, 1)
                              : i == 1 ? Eigen::Vector3d(0, 0, -1)
                                       : random_direction(rng);
    Eigen::Matrix3d basis;
    basis << tangent_basis(n), n;
    EXPECT_LT((basis.transpose() * basis - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(basis.determinant(), 1.0, 1e-14);
  }
}

TEST(TriangulateTwoViews, FindsTheExactPointAllRound) {
  Rng rng(2, 0);
  for (int i = 0; i < 500; ++i) {
    const Rigid3 b_from_a = random_pose(rng, rng.uniform(0.0, 3.0), 1.0);
    const Eigen::Vector3d point = 3.0 * random_vector(rng);
    const Eigen::Vector3d a = point.normalized(), b = (b_from_a * point).normalized();
    const Rigid3 a_from_b = b_from_a.inverse();
    const double parallax = parallax_angle(a, b, a_from_b);
    if (std::sin(parallax) < 1e-3) continue;
    const auto estimate = triangulate(a, b, a_from_b, 1e-3);
    ASSERT_TRUE(estimate);
    EXPECT_LT((*estimate - point).norm(), 1e-9 * point.norm() / parallax);
    // The definition of parallax: the angle at the point.
    EXPECT_NEAR(parallax, angle_between(-point, a_from_b.translation - point), 1e-12);
  }
}

TEST(TriangulateTwoViews, RefusesPointsBehindEitherBearing) {
  Rng rng(3, 0);
  int num_tested = 0;
  for (int i = 0; i < 200; ++i) {
    const Rigid3 b_from_a = random_pose(rng, 0.3, 1.0);
    const Eigen::Vector3d point = 3.0 * random_vector(rng);
    const Eigen::Vector3d a = point.normalized(), b = (b_from_a * point).normalized();
    const Rigid3 a_from_b = b_from_a.inverse();
    if (std::sin(parallax_angle(a, b, a_from_b)) < 0.05) continue;
    ++num_tested;
    EXPECT_TRUE(triangulate(a, b, a_from_b, 0.01));
    EXPECT_FALSE(triangulate(-a, b, a_from_b, 0.01));
    EXPECT_FALSE(triangulate(a, -b, a_from_b, 0.01));
    EXPECT_FALSE(triangulate(-a, -b, a_from_b, 0.01));
  }
  EXPECT_GT(num_tested, 100);
}

TEST(TriangulateTwoViews, RefusesLittleParallaxAndDegenerateInput) {
  const Rigid3 sideways(Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitX());
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d turned(-std::sin(0.01), 0.0, std::cos(0.01));
  EXPECT_TRUE(triangulate(forward, turned, sideways, 0.0099));
  EXPECT_FALSE(triangulate(forward, turned, sideways, 0.0101));
  EXPECT_FALSE(triangulate(forward, forward, sideways, 0.0));
  EXPECT_FALSE(triangulate(forward, turned, Rigid3{}, 0.0));  // no baseline
  EXPECT_FALSE(triangulate(Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitX(), sideways, 0.0));
  const Eigen::Vector3d nan = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(triangulate(nan, turned, sideways, 0.0));
}

// OpenCV minimises an algebraic error, so under noise ours has to be as good, and better in angle.
TEST(TriangulateTwoViews, HasSmallerAngularErrorThanOpenCv) {
  Rng rng(4, 0);
  double ours = 0.0, theirs = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Rigid3 b_from_a(so3_exp(0.1 * random_vector(rng)), 0.4 * random_direction(rng));
    const Eigen::Vector3d point(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(2, 6));
    const Eigen::Vector3d a = disturb(point.normalized(), 0.002, rng);
    const Eigen::Vector3d b = disturb((b_from_a * point).normalized(), 0.002, rng);
    const auto estimate = triangulate(a, b, b_from_a.inverse(), 0.02);
    if (!estimate) continue;
    cv::Mat projection_a = cv::Mat::eye(3, 4, CV_64F), projection_b(3, 4, CV_64F), homogeneous;
    const Eigen::Matrix4d matrix = b_from_a.matrix();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) projection_b.at<double>(r, c) = matrix(r, c);
    }
    const std::vector<cv::Point2d> pixel_a{{a.x() / a.z(), a.y() / a.z()}};
    const std::vector<cv::Point2d> pixel_b{{b.x() / b.z(), b.y() / b.z()}};
    cv::triangulatePoints(projection_a, projection_b, pixel_a, pixel_b, homogeneous);
    const Eigen::Vector3d oracle =
        Eigen::Vector3d(
            homogeneous.at<double>(0), homogeneous.at<double>(1), homogeneous.at<double>(2)) /
        homogeneous.at<double>(3);
    EXPECT_LT((*estimate - oracle).norm(), 0.2 * point.norm());
    const auto squared_error = [&](const Eigen::Vector3d& x) {
      return std::pow(angle_between(a, x), 2) + std::pow(angle_between(b, b_from_a * x), 2);
    };
    ours += squared_error(*estimate);
    theirs += squared_error(oracle);
  }
  EXPECT_GT(ours, 0.0);
  EXPECT_LT(ours, 1.02 * theirs);
}

}  // namespace
}  // namespace waymark

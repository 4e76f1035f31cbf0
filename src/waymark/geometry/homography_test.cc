// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/homography.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::make_scene;
using testing::random_direction;
using testing::random_pose;
using testing::TwoViewScene;
using testing::View;

using FourBearings = std::span<const Eigen::Vector3d, 4>;

struct Plane {
  Eigen::Vector3d normal_in_a;
  double distance;

  Eigen::Matrix3d homography(const Rigid3& b_from_a) const {
    return b_from_a.rotation_matrix() + b_from_a.translation * normal_in_a.transpose() / distance;
  }
};

// A scene of points on a plane in front of both views, seen by a camera that looks all round, so
// that the plane may lie in any direction.
TwoViewScene plane_scene(const Rigid3& b_from_a,
                         const Plane& plane,
                         std::size_t num_matches,
                         double sigma_rad,
                         Rng& rng) {
  return make_scene(b_from_a, View{true}, num_matches, sigma_rad, 0.0, rng, [&](Rng& r) {
    while (true) {
      const Eigen::Vector3d ray = random_direction(r);
      const double cosine = ray.dot(plane.normal_in_a);
      if (cosine > 0.3) return Eigen::Vector3d(plane.distance / cosine * ray);
    }
  });
}

cv::Mat to_cv(const Eigen::Matrix3d& matrix) {
  cv::Mat result(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result.at<double>(r, c) = matrix(r, c);
  }
  return result;
}

TEST(FourPoint, FindsTheHomographyOfAnyPlane) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const Rigid3 b_from_a = random_pose(rng, rng.uniform(0.0, 3.0), 0.8);
    const Plane plane{random_direction(rng), 2.0};
    const TwoViewScene scene = plane_scene(b_from_a, plane, 4, 0.0, rng);
    const auto homography = solve_four_point(FourBearings(scene.bearings_a.data(), 4),
                                             FourBearings(scene.bearings_b.data(), 4));
    ASSERT_TRUE(homography);
    EXPECT_LT((*homography - plane.homography(b_from_a).normalized()).norm(), 1e-6);
  }
}

TEST(FourPoint, RefusesDegenerateAndImpossibleSamples) {
  Rng rng(2, 0);
  const Plane plane{Eigen::Vector3d::UnitZ(), 2.0};
  const TwoViewScene scene = plane_scene(random_pose(rng, 0.2, 0.5), plane, 4, 0.0, rng);
  const FourBearings a(scene.bearings_a.data(), 4), b(scene.bearings_b.data(), 4);
  const std::vector<Eigen::Vector3d> same(4, Eigen::Vector3d::UnitZ());
  EXPECT_FALSE(solve_four_point(FourBearings(same.data(), 4), b));
  EXPECT_FALSE(solve_four_point(a, FourBearings(same.data(), 4)));
  std::vector<Eigen::Vector3d> flipped = scene.bearings_b;
  flipped[2] = -flipped[2];  // behind
  EXPECT_FALSE(solve_four_point(a, FourBearings(flipped.data(), 4)));
}

TEST(HomographyError, IsChiSquaredOfTwoDegreesForTrueMatches) {
  Rng rng(3, 0);
  double sum = 0.0;
  std::size_t count = 0, num_beyond = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const Rigid3 b_from_a = random_pose(rng, 0.5, 1.2);
    const Plane plane{random_direction(rng), 2.0};
    const TwoViewScene scene = plane_scene(b_from_a, plane, 300, 0.002, rng);
    for (std::size_t i = 0; i < 300; ++i) {
      const double e = squared_homography_error(plane.homography(b_from_a), scene.matches(), i);
      sum += e;
      num_beyond += e > 5.99;
      ++count;
    }
  }
  const double n = static_cast<double>(count);
  EXPECT_NEAR(sum / n, 2.0, 4.0 * 2.0 / std::sqrt(n));
  EXPECT_NEAR(static_cast<double>(num_beyond) / n, 0.05, 4.0 * std::sqrt(0.05 * 0.95 / n));
}

TEST(HomographyError, IsInfiniteForTheOppositeSide) {
  Rng rng(4, 0);
  const TwoViewScene scene = plane_scene(Rigid3{}, {Eigen::Vector3d::UnitZ(), 2.0}, 1, 0.0, rng);
  EXPECT_NEAR(
      squared_homography_error(
          Eigen::Matrix3d::Identity(),
          {scene.bearings_a, scene.bearings_a, std::vector<double>{1.0}, std::vector<double>{1.0}},
          0),
      0.0,
      1e-20);
  const BearingMatches matches = scene.matches();
  EXPECT_EQ(squared_homography_error(-Eigen::Matrix3d::Identity(), matches, 0),
            std::numeric_limits<double>::infinity());
}

TEST(RefineHomography, IsBetterThanFourPointsAndStationary) {
  Rng rng(5, 0);
  const Rigid3 b_from_a = random_pose(rng, 0.4, 1.0);
  const Plane plane{random_direction(rng), 2.0};
  const TwoViewScene scene = plane_scene(b_from_a, plane, 200, 0.002, rng);
  const auto initial = solve_four_point(FourBearings(scene.bearings_a.data(), 4),
                                        FourBearings(scene.bearings_b.data(), 4));
  ASSERT_TRUE(initial);
  const auto refined = refine_homography(*initial, scene.matches(), scene.indices());
  ASSERT_TRUE(refined);
  const auto cost = [&](const Eigen::Matrix3d& h) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 200; ++i) sum += squared_homography_error(h, scene.matches(), i);
    return sum;
  };
  // 392 degrees of freedom; the refinement averages the noise of a over its two directions.
  EXPECT_LT(cost(*refined), 392.0 + 4.0 * std::sqrt(2.0 * 392.0));
  EXPECT_LT(cost(*refined), cost(*initial));
  Eigen::Matrix3d last = *refined, before = *refined;
  for (int i = 0; i < 5; ++i) {
    before = last;
    last = *refine_homography(last, scene.matches(), scene.indices());
  }
  EXPECT_LT((last - before).norm(), 1e-6);
  EXPECT_LT((last - *refined).norm(), 3e-4);
  EXPECT_FALSE(refine_homography(*initial, scene.matches(), std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(DecomposeHomography, HasTheTrueMotion) {
  Rng rng(6, 0);
  for (int trial = 0; trial < 300; ++trial) {
    const Rigid3 b_from_a = random_pose(rng, rng.uniform(0.0, 3.0), 0.9);
    const Plane plane{random_direction(rng), rng.uniform(1.0, 4.0)};
    const Eigen::Matrix3d homography = rng.uniform(0.1, 5.0) * plane.homography(b_from_a);
    const std::vector<PlanarMotion> motions = decompose_homography(homography);
    ASSERT_EQ(motions.size(), 4u);
    double nearest = 100.0;
    for (const PlanarMotion& motion : motions) {
      const double error =
          (motion.b_from_a.rotation_matrix() - b_from_a.rotation_matrix()).norm() +
          (motion.b_from_a.translation - b_from_a.translation / plane.distance).norm() +
          (motion.normal_in_a - plane.normal_in_a).norm();
      nearest = std::min(nearest, error);
      const Eigen::Matrix3d rebuilt = motion.b_from_a.rotation_matrix() +
                                      motion.b_from_a.translation * motion.normal_in_a.transpose();
      EXPECT_LT((rebuilt.normalized() - homography.normalized()).norm(), 1e-7);
    }
    EXPECT_LT(nearest, 1e-5);
  }
}

TEST(DecomposeHomography, HasTheSolutionsOfOpenCv) {
  Rng rng(7, 0);
  for (int trial = 0; trial < 50; ++trial) {
    const Rigid3 b_from_a = random_pose(rng, 0.3, 0.9);
    const Plane plane{random_direction(rng), 2.0};
    const Eigen::Matrix3d homography = plane.homography(b_from_a);
    std::vector<cv::Mat> rotations, translations, normals;
    cv::decomposeHomographyMat(
        to_cv(homography), cv::Mat::eye(3, 3, CV_64F), rotations, translations, normals);
    const std::vector<PlanarMotion> motions = decompose_homography(homography);
    ASSERT_EQ(motions.size(), rotations.size());
    for (std::size_t k = 0; k < rotations.size(); ++k) {
      double nearest = 100.0;
      for (const PlanarMotion& motion : motions) {
        const auto& t = translations[k];
        const auto& n = normals[k];
        nearest = std::min(nearest,
                           cv::norm(to_cv(motion.b_from_a.rotation_matrix()), rotations[k]) +
                               (motion.b_from_a.translation -
                                Eigen::Vector3d(t.at<double>(0), t.at<double>(1), t.at<double>(2)))
                                   .norm() +
                               (motion.normal_in_a -
                                Eigen::Vector3d(n.at<double>(0), n.at<double>(1), n.at<double>(2)))
                                   .norm());
      }
      EXPECT_LT(nearest, 1e-5);
    }
  }
}

TEST(DecomposeHomography, OfARotationHasNoTranslation) {
  Rng rng(8, 0);
  const Rigid3 b_from_a = random_pose(rng, 0.7, 0.0);
  const std::vector<PlanarMotion> motions = decompose_homography(3.0 * b_from_a.rotation_matrix());
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_LT(testing::rotation_error_rad(motions[0].b_from_a, b_from_a), 1e-7);
  EXPECT_EQ(motions[0].b_from_a.translation.norm(), 0.0);
  EXPECT_TRUE(decompose_homography(Eigen::Matrix3d::Zero()).empty());
  EXPECT_TRUE(decompose_homography(-Eigen::Matrix3d::Identity()).empty());
}

}  // namespace
}  // namespace waymark

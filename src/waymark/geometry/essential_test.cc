// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/essential.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/relative_pose.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::make_scene;
using testing::random_direction;
using testing::random_pose;
using testing::TwoViewScene;
using testing::View;

using FiveBearings = std::span<const Eigen::Vector3d, 5>;

// Distance of two matrices that are defined up to sign.
double distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

double nearest_distance(const std::vector<Eigen::Matrix3d>& candidates,
                        const Eigen::Matrix3d& truth) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& candidate : candidates) {
    nearest = std::min(nearest, distance(candidate, truth));
  }
  return nearest;
}

std::vector<Eigen::Matrix3d> solve(const TwoViewScene& scene) {
  return solve_five_point(FiveBearings(scene.bearings_a.data(), 5),
                          FiveBearings(scene.bearings_b.data(), 5));
}

// How far rounding alone can move the true matrix: the constraints b^T E a are known to about one
// rounding error, and the essential matrix changes by as much over the least singular value of
// their derivative by the motion (taken numerically).
double rounding_error(const TwoViewScene& scene) {
  constexpr double kStep = 1e-6;
  const Rigid3 motion(scene.b_from_a.rotation, scene.b_from_a.translation.normalized());
  Eigen::Matrix<double, 5, 5> jacobian;
  for (int k = 0; k < 5; ++k) {
    const Vector5d step = kStep * Vector5d::Unit(k);
    const Eigen::Matrix3d change = essential_from_pose(perturb_relative_pose(motion, step)) -
                                   essential_from_pose(perturb_relative_pose(motion, -step));
    for (int i = 0; i < 5; ++i) {
      jacobian(i, k) = scene.bearings_b[i].dot(change * scene.bearings_a[i]) / (2.0 * kStep);
    }
  }
  const Eigen::VectorXd singular = Eigen::MatrixXd(jacobian).jacobiSvd().singularValues();
  return std::numeric_limits<double>::epsilon() / singular[4];
}

Eigen::Vector3d point_all_round(Rng& rng) { return rng.uniform(1.0, 5.0) * random_direction(rng); }

Eigen::Vector3d point_ahead(Rng& rng) {
  const double z = rng.uniform(2.0, 6.0);
  const double x = rng.uniform(-1.0, 1.0), y = rng.uniform(-0.6, 0.6);
  return z * Eigen::Vector3d(x, y, 1.0);
}

TEST(FivePoint, SolutionsAreEssentialMatricesThatFitTheSample) {
  Rng rng(1, 0);
  std::size_t num_solutions = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const TwoViewScene scene = make_scene(random_pose(rng, rng.uniform(0.0, 3.0), 1.0),
                                          View{true},
                                          5,
                                          0.0,
                                          0.0,
                                          rng,
                                          point_all_round);
    for (const Eigen::Matrix3d& e : solve(scene)) {
      ++num_solutions;
      EXPECT_NEAR(e.norm(), std::sqrt(2.0), 1e-12);
      EXPECT_NEAR(e.determinant(), 0.0, 1e-9);
      const Eigen::Matrix3d gram = e * e.transpose();
      EXPECT_LT((gram * e - 0.5 * gram.trace() * e).norm(), 1e-9);
      for (int i = 0; i < 5; ++i) {
        EXPECT_NEAR(scene.bearings_b[i].dot(e * scene.bearings_a[i]), 0.0, 1e-12);
      }
    }
  }
  EXPECT_GT(num_solutions, 400u);  // about 4.5 real roots a sample
}

TEST(FivePoint, FindsTheTrueMatrix) {
  Rng rng(2, 0);
  std::vector<double> errors;
  for (int trial = 0; trial < 400; ++trial) {
    const bool is_all_round = trial % 2 == 0;
    const Rigid3 b_from_a = random_pose(rng, is_all_round ? 2.0 : 0.2, 0.7);
    const TwoViewScene scene =
        is_all_round ? make_scene(b_from_a, View{true}, 5, 0.0, 0.0, rng, point_all_round)
                     : make_scene(b_from_a, View{}, 5, 0.0, 0.0, rng, point_ahead);
    errors.push_back(nearest_distance(solve(scene), essential_from_pose(b_from_a)) /
                     rounding_error(scene));
  }
  EXPECT_LT(testing::quantile(errors, 0.5), 1.0);
  EXPECT_LT(testing::quantile(errors, 0.99), 10.0);
}

TEST(FivePoint, FindsTheTrueMatrixOfAPlaneAndOfPureForwardMotion) {
  Rng rng(3, 0);
  std::vector<double> errors;
  for (int trial = 0; trial < 200; ++trial) {
    const Rigid3 b_from_a(Eigen::Quaterniond::Identity(), {0.0, 0.0, -0.5});
    const TwoViewScene scene = make_scene(b_from_a, View{}, 5, 0.0, 0.0, rng, [](Rng& r) {
      const Eigen::Vector3d ray = testing::random_bearing(r, View{});
      return Eigen::Vector3d(5.0 / (ray.z() + 0.3 * ray.x()) * ray);
    });
    errors.push_back(nearest_distance(solve(scene), essential_from_pose(b_from_a)) /
                     rounding_error(scene));
  }
  EXPECT_LT(testing::quantile(errors, 0.5), 1.0);
  // In the others two roots all but meet, so that rounding makes them complex: no solution.
  EXPECT_LT(testing::quantile(errors, 0.95), 10.0);
}

// OpenCV's own five-point solver, given just five points, returns its solutions as stacked 3x3.
TEST(FivePoint, FindsTheSolutionsThatOpenCvFinds) {
  Rng rng(4, 0);
  int num_found = 0, num_oracles = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const TwoViewScene scene =
        make_scene(random_pose(rng, 0.3, 1.0), View{}, 5, 0.001, 0.0, rng, point_ahead);
    std::vector<cv::Point2d> points_a, points_b;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d &a = scene.bearings_a[i], &b = scene.bearings_b[i];
      points_a.emplace_back(a.x() / a.z(), a.y() / a.z());
      points_b.emplace_back(b.x() / b.z(), b.y() / b.z());
    }
    const cv::Mat stacked =
        cv::findEssentialMat(points_a, points_b, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC);
    const std::vector<Eigen::Matrix3d> solutions = solve(scene);
    for (int k = 0; 3 * k < stacked.rows; ++k) {
      Eigen::Matrix3d oracle;
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) oracle(r, c) = stacked.at<double>(3 * k + r, c);
      }
      oracle *= std::sqrt(2.0) / oracle.norm();
      ++num_oracles;
      num_found += nearest_distance(solutions, oracle) < 1e-4;
    }
  }
  EXPECT_GE(num_oracles, 50);
  EXPECT_GE(num_found, num_oracles - num_oracles / 50);
}

TEST(FivePoint, DegenerateSamplesStayFinite) {
  Rng rng(5, 0);
  const std::vector<Eigen::Vector3d> same(5, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> spread, zeros(5, Eigen::Vector3d::Zero());
  for (int i = 0; i < 5; ++i) spread.push_back(random_direction(rng));
  for (const auto& a : {same, spread, zeros}) {
    for (const auto& b : {same, spread, zeros}) {  // spread to spread: no translation
      for (const Eigen::Matrix3d& e :
           solve_five_point(FiveBearings(a.data(), 5), FiveBearings(b.data(), 5))) {
        EXPECT_TRUE(e.allFinite());
      }
    }
  }
}

TEST(DecomposeEssential, HasTheTruePoseAndFourThatFit) {
  Rng rng(6, 0);
  for (int trial = 0; trial < 100; ++trial) {
    const Rigid3 b_from_a = random_pose(rng, rng.uniform(0.0, 3.1), 1.0);
    // Any scale and sign.
    const Eigen::Matrix3d essential = rng.uniform(-3.0, 3.0) * essential_from_pose(b_from_a);
    double nearest = 10.0;
    for (const Rigid3& pose : decompose_essential(essential)) {
      EXPECT_NEAR(pose.translation.norm(), 1.0, 1e-12);
      EXPECT_LT(distance(essential_from_pose(pose), essential_from_pose(b_from_a)), 1e-9);
      nearest = std::min(nearest,
                         testing::rotation_error_rad(pose, b_from_a) +
                             testing::direction_error_rad(pose, b_from_a));
    }
    EXPECT_LT(nearest, 1e-7);
  }
}

TEST(DecomposeEssential, HasTheRotationsOfOpenCv) {
  Rng rng(7, 0);
  const Eigen::Matrix3d essential = essential_from_pose(random_pose(rng, 0.8, 1.0));
  cv::Mat input(3, 3, CV_64F), rotations[2], t;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) input.at<double>(r, c) = essential(r, c);
  }
  cv::decomposeEssentialMat(input, rotations[0], rotations[1], t);
  const std::array<Rigid3, 4> poses = decompose_essential(essential);
  for (const cv::Mat& rotation : rotations) {
    double nearest = 10.0;
    for (const Rigid3& pose : poses) {
      Eigen::Matrix3d oracle;
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) oracle(r, c) = rotation.at<double>(r, c);
      }
      nearest = std::min(nearest, (pose.rotation_matrix() - oracle).norm());
    }
    EXPECT_LT(nearest, 1e-9);
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/absolute_pose.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "waymark/geometry/ransac.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::disturb;
using testing::quantile;
using testing::random_bearing;
using testing::random_direction;
using testing::random_pose;
using testing::rotation_error_rad;
using testing::View;

struct ThreePoints {
  Rigid3 cam_from_world;
  std::array<Eigen::Vector3d, 3> bearings;
  std::array<Eigen::Vector3d, 3> points_in_world;
};

ThreePoints make_three_points(Rng& rng, const View& view) {
  ThreePoints scene;
  scene.cam_from_world = random_pose(rng, rng.uniform(0.0, M_PI), 5.0);
  for (std::size_t i = 0; i < 3; ++i) {
    scene.bearings[i] = random_bearing(rng, view);
    scene.points_in_world[i] =
        scene.cam_from_world.inverse() * (rng.uniform(0.5, 20.0) * scene.bearings[i]);
  }
  return scene;
}

double pose_error(const Rigid3& estimate, const Rigid3& truth) {
  return rotation_error_rad(estimate, truth) + (estimate.translation - truth.translation).norm();
}

double least_error(const std::vector<Rigid3>& poses, const Rigid3& truth) {
  double least = std::numeric_limits<double>::infinity();
  for (const Rigid3& pose : poses) least = std::min(least, pose_error(pose, truth));
  return least;
}

TEST(AbsoluteThreePoint, TruthIsAmongTheSolutionsForNarrowAndAllRoundViews) {
  for (const View& view :
       {View{}, View{.tan_half_width = 0.1, .tan_half_height = 0.1}, View{.sees_all = true}}) {
    Rng rng(1, view.sees_all);
    std::vector<double> errors;
    for (int i = 0; i < 8000; ++i) {
      const ThreePoints scene = make_three_points(rng, view);
      const auto poses = solve_absolute_three_point(scene.bearings, scene.points_in_world);
      ASSERT_LE(poses.size(), 4u);
      errors.push_back(least_error(poses, scene.cam_from_world));
    }
    EXPECT_LT(quantile(errors, 0.5), 1e-12);
    EXPECT_LT(quantile(errors, 0.999), 1e-6);
    EXPECT_LT(quantile(errors, 1.0), 1e-2);
  }
}

TEST(AbsoluteThreePoint, EverySolutionSeesThePointsAlongTheBearings) {
  Rng rng(2, 0);
  for (int i = 0; i < 5000; ++i) {
    const ThreePoints scene = make_three_points(rng, {.sees_all = i % 2 == 0});
    for (const Rigid3& pose : solve_absolute_three_point(scene.bearings, scene.points_in_world)) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d predicted = (pose * scene.points_in_world[k]).normalized();
        EXPECT_LT((predicted - scene.bearings[k]).norm(), 1e-6) << i;
      }
    }
  }
}

/// The distances along the bearings by Newton's method from a grid of starts.
std::vector<Eigen::Vector3d> search_distances(const ThreePoints& scene) {
  const auto& x = scene.points_in_world;
  const auto& y = scene.bearings;
  double size = 0.0;
  for (std::size_t k = 0; k < 3; ++k) size = std::max(size, (x[k] - x[(k + 1) % 3]).norm());
  std::vector<Eigen::Vector3d> found;
  const auto descend = [&](Eigen::Vector3d d) {
    for (int iteration = 0; iteration < 40; ++iteration) {
      Eigen::Vector3d errors;
      Eigen::Matrix3d by_d = Eigen::Matrix3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const int j = (k + 1) % 3;
        const Eigen::Vector3d side = d[k] * y[k] - d[j] * y[j];
        errors[k] = side.squaredNorm() - (x[k] - x[j]).squaredNorm();
        by_d(k, k) = 2.0 * side.dot(y[k]);
        by_d(k, j) = -2.0 * side.dot(y[j]);
      }
      const Eigen::Vector3d step = by_d.fullPivLu().solve(errors);
      d -= step;
      if (step.norm() < 1e-13 * size) {
        const bool is_new = std::none_of(found.begin(), found.end(), [&](const auto& other) {
          return (other - d).norm() < 1e-6 * size;
        });
        if (is_new && d.minCoeff() > 0.0 && errors.norm() < 1e-9 * size * size) found.push_back(d);
        return;
      }
    }
  };
  constexpr int kNumSteps = 6;
  for (int i = 0; i < kNumSteps * kNumSteps * kNumSteps; ++i) {
    const Eigen::Vector3d cell(i % kNumSteps, i / kNumSteps % kNumSteps, i / kNumSteps / kNumSteps);
    // Denser where the distances are short; up to the diameter of the circle through a side.
    descend(size * ((cell.array() + 0.5) / kNumSteps).pow(1.5) * 4.0);
  }
  return found;
}

TEST(AbsoluteThreePoint, FindsAllSolutionsThatAnExhaustiveSearchFinds) {
  std::array<int, 5> num_scenes_with{};
  double num_solved = 0.0, num_expected = 0.0;
  for (int i = 0; i < 150; ++i) {
    Rng rng(3, static_cast<std::uint64_t>(i));
    const ThreePoints scene = make_three_points(rng, {.sees_all = i % 2 == 0});
    const auto poses = solve_absolute_three_point(scene.bearings, scene.points_in_world);
    const auto expected = search_distances(scene);
    for (const Eigen::Vector3d& d : expected) {
      const bool is_found = std::any_of(poses.begin(), poses.end(), [&](const Rigid3& pose) {
        Eigen::Vector3d distances;
        for (std::size_t k = 0; k < 3; ++k) {
          distances[static_cast<int>(k)] = (pose * scene.points_in_world[k]).norm();
        }
        return (distances - d).norm() < 1e-5 * d.norm();
      });
      EXPECT_TRUE(is_found) << i << ": " << d.transpose();
    }
    EXPECT_GE(poses.size(), expected.size()) << i;
    ++num_scenes_with[poses.size()];
    num_solved += static_cast<double>(poses.size());
    num_expected += static_cast<double>(expected.size());
  }
  EXPECT_GT(num_expected, 0.95 * num_solved);
  // The test means little unless there are scenes of each kind.
  EXPECT_GT(num_scenes_with[1], 10);
  EXPECT_GT(num_scenes_with[2], 10);
  EXPECT_GT(num_scenes_with[4], 3);
  EXPECT_EQ(num_scenes_with[0], 0);
}

TEST(AbsoluteThreePoint, FindsTheFourSolutionsOfASymmetricPyramid) {
  // Fischler & Bolles 1981, figure 5: seen from an apex above an equilateral triangle, one
  // solution is symmetric, and one more per corner has that corner nearer.
  ThreePoints scene;
  for (std::size_t k = 0; k < 3; ++k) {
    const double angle = 2.0 * M_PI * static_cast<double>(k) / 3.0;
    scene.points_in_world[k] = {std::cos(angle), std::sin(angle), 2.0};
    scene.bearings[k] = scene.points_in_world[k].normalized();
  }
  const auto poses = solve_absolute_three_point(scene.bearings, scene.points_in_world);
  EXPECT_EQ(poses.size(), 4u);
  EXPECT_LT(least_error(poses, Rigid3()), 1e-12);
}

TEST(AbsoluteThreePoint, StaysNearTheTruthWhereTwoSolutionsMerge) {
  // On the cylinder through the three points whose axis is normal to their plane, two solutions
  // coincide (Smith 1965) and the error is the root of the rounding.
  for (int i = 0; i < 300; ++i) {
    Rng rng(4, static_cast<std::uint64_t>(i));
    ThreePoints scene;
    const double turn = rng.uniform(0.0, 6.0);
    const Eigen::Vector3d centre(std::cos(turn), std::sin(turn), rng.uniform(0.5, 3.0));
    scene.cam_from_world.rotation = so3_exp(2.0 * random_direction(rng));
    scene.cam_from_world.translation = -(scene.cam_from_world.rotation * centre);
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = 2.0 * static_cast<double>(k) + rng.uniform(-0.5, 0.5);
      scene.points_in_world[k] = {std::cos(angle), std::sin(angle), 0.0};
      scene.bearings[k] = (scene.cam_from_world * scene.points_in_world[k]).normalized();
    }
    const auto poses = solve_absolute_three_point(scene.bearings, scene.points_in_world);
    EXPECT_LT(least_error(poses, scene.cam_from_world), 1e-3) << i;
  }
}

TEST(AbsoluteThreePoint, NoneForDegeneratePoints) {
  Rng rng(5, 0);
  const ThreePoints good = make_three_points(rng, {});
  ThreePoints scene = good;
  scene.points_in_world[2] = 3.0 * scene.points_in_world[1] - 2.0 * scene.points_in_world[0];
  EXPECT_TRUE(solve_absolute_three_point(scene.bearings, scene.points_in_world).empty());
  scene.points_in_world[2] = scene.points_in_world[0];
  EXPECT_TRUE(solve_absolute_three_point(scene.bearings, scene.points_in_world).empty());
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    scene = good;
    scene.points_in_world[1].y() = bad;
    EXPECT_TRUE(solve_absolute_three_point(scene.bearings, scene.points_in_world).empty());
    scene = good;
    scene.bearings[1].y() = bad;
    EXPECT_TRUE(solve_absolute_three_point(scene.bearings, scene.points_in_world).empty());
  }
}

TEST(AbsoluteThreePoint, DegenerateBearingsGiveFinitePosesThatFit) {
  for (int i = 0; i < 600; ++i) {
    Rng rng(6, static_cast<std::uint64_t>(i));
    ThreePoints scene = make_three_points(rng, {.sees_all = true});
    auto& y = scene.bearings;
    if (i % 3 == 0) y[1] = y[0];   // one ray for two points
    if (i % 3 == 1) y[1] = -y[0];  // opposite rays
    if (i % 3 == 2) y[2] = (y[0] + rng.uniform(-2.0, 2.0) * y[1]).normalized();  // all in a plane
    for (const Rigid3& pose : solve_absolute_three_point(y, scene.points_in_world)) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d predicted = (pose * scene.points_in_world[k]).normalized();
        ASSERT_LT((predicted - y[k]).norm(), 1e-3) << i;
      }
    }
  }
}

struct ObservationScene {
  Rigid3 cam_from_world;
  std::vector<Eigen::Vector3d> points_in_world, bearings;
  std::vector<double> sigmas_rad;
  std::vector<std::uint8_t> is_outlier;

  PointObservations observations() const { return {points_in_world, bearings, sigmas_rad}; }
};

ObservationScene make_scene(const View& view, double outlier_share, Rng& rng) {
  ObservationScene scene;
  scene.cam_from_world = random_pose(rng, rng.uniform(0.0, M_PI), 5.0);
  for (int i = 0; i < 200; ++i) {
    const double sigma = 0.002 * std::pow(1.2, rng.below(8));
    const Eigen::Vector3d bearing = random_bearing(rng, view);
    const bool is_outlier = rng.uniform() < outlier_share;
    scene.points_in_world.push_back(scene.cam_from_world.inverse() *
                                    (rng.uniform(2.0, 20.0) * bearing));
    scene.bearings.push_back(is_outlier ? random_bearing(rng, view) : disturb(bearing, sigma, rng));
    scene.sigmas_rad.push_back(sigma);
    scene.is_outlier.push_back(is_outlier);
  }
  return scene;
}

TEST(AbsolutePoseEstimator, FindsThePoseAmongOutliers) {
  for (int i = 0; i < 20; ++i) {
    Rng rng(7, static_cast<std::uint64_t>(i));
    const ObservationScene scene = make_scene({.sees_all = i % 2 == 0}, 0.7, rng);
    const auto result =
        ransac(AbsolutePoseEstimator(scene.observations()), {.seed = 1, .min_inlier_ratio = 0.15});
    ASSERT_TRUE(result.has_value()) << i;
    EXPECT_LT(rotation_error_rad(result->model, scene.cam_from_world), 0.005) << i;
    EXPECT_LT((result->model.translation - scene.cam_from_world.translation).norm(), 0.1) << i;
    int num_wrong = 0;
    for (const std::uint32_t index : result->inliers) num_wrong += scene.is_outlier[index];
    EXPECT_LE(num_wrong, 2) << i;
    EXPECT_GT(result->inliers.size(), 40u) << i;
  }
}

TEST(AbsolutePoseEstimator, FindsLittleSupportAmongRandomObservations) {
  Rng rng(8, 0);
  const ObservationScene scene = make_scene({}, 1.0, rng);
  const auto result =
      ransac(AbsolutePoseEstimator(scene.observations()), {.seed = 1, .min_inlier_ratio = 0.2});
  EXPECT_TRUE(!result || result->inliers.size() < 15);
}

TEST(AbsolutePoseEstimator, APointBehindItsBearingIsAnOutlier) {
  const std::vector<Eigen::Vector3d> points_in_world = {
      {0.0, 0.0, 4.0}, {0.0, 0.0, -4.0}, {0.0, 0.0, 0.0}};
  const std::vector<Eigen::Vector3d> bearings(3, Eigen::Vector3d::UnitZ());
  const std::vector<double> sigmas_rad(3, 0.01);
  const AbsolutePoseEstimator estimator({points_in_world, bearings, sigmas_rad});
  EXPECT_EQ(estimator.squared_error(Rigid3(), 0), 0.0);
  EXPECT_GT(estimator.squared_error(Rigid3(), 1), 1e4);
  EXPECT_GT(estimator.squared_error(Rigid3(), 2), 1e3);
}

}  // namespace
}  // namespace waymark

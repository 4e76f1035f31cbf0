// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <limits>

#include "waymark/base/check.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

using testing::make_pose_scene;
using testing::PoseScene;
using testing::random_tangent;

Rigid3 perturb(const Rigid3& pose, double translation, double rotation, std::uint64_t seed) {
  Rng rng(seed, 9);
  return Rigid3::exp(random_tangent(rng, translation, rotation)) * pose;
}

Vector6d error_of(const Rigid3& estimate, const Rigid3& truth) {
  return (estimate * truth.inverse()).log();
}

PoseEstimate run(const PoseScene& scene, const Rigid3& initial, PoseWorkspace& workspace) {
  return optimize_pose(scene.rig, scene.observations, initial, workspace);
}

/// Autodiff residual with its own formulas: angle-axis increments on the initial pose.
struct PoseOracle {
  Eigen::Vector3d point_in_cam;  // At the initial pose.
  Eigen::Vector3d bearing;
  Matrix23d w;

  template <class T>
  bool operator()(const T* increment, T* residual) const {
    const T point[3] = {T(point_in_cam.x()), T(point_in_cam.y()), T(point_in_cam.z())};
    T moved[3];
    ceres::AngleAxisRotatePoint(increment + 3, point, moved);
    for (int i = 0; i < 3; ++i) moved[i] += increment[i];
    using std::sqrt;
    const T range = sqrt(moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]);
    for (int row = 0; row < 2; ++row) {
      residual[row] = T(0.0);
      for (int i = 0; i < 3; ++i) residual[row] += w(row, i) * (moved[i] / range - bearing[i]);
    }
    return true;
  }
};

Rigid3 solve_with_ceres(const PoseScene& scene, const Rigid3& initial, double huber_scale) {
  ceres::Problem problem;
  double increment[6] = {};
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const auto& observations = scene.observations;
    auto* cost = new ceres::AutoDiffCostFunction<PoseOracle, 2, 6>(
        new PoseOracle{initial * observations.point_in_world[i],
                       observations.bearing[i].cast<double>(),
                       observations.level_pixel_from_bearing[i].cast<double>()});
    problem.AddResidualBlock(cost, new ceres::HuberLoss(huber_scale), increment);
  }
  ceres::Solver::Options options;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Eigen::Quaterniond rotation;
  double wxyz[4];
  ceres::AngleAxisToQuaternion(increment + 3, wxyz);
  rotation = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  return Rigid3(rotation, Eigen::Vector3d(increment[0], increment[1], increment[2])) * initial;
}

TEST(Pose, FindsThePoseExactlyWithoutNoise) {
  for (const std::size_t num_cameras : {1u, 2u, 3u}) {
    const PoseScene scene =
        make_pose_scene({.num_cameras = num_cameras, .noise_px = 0.0}, num_cameras);
    PoseWorkspace workspace;
    const auto estimate =
        run(scene, perturb(scene.rig_from_world, 0.1, 0.02, num_cameras), workspace);
    // A hundredth of what 1 px of noise would leave.
    EXPECT_LT(error_of(estimate.rig_from_world, scene.rig_from_world).norm(), 1e-4);
    EXPECT_EQ(estimate.num_inliers, scene.observations.size());
  }
}

TEST(Pose, AgreesWithCeresAutodiff) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    // So little noise that every observation passes the gate, and Huber's loss still matters.
    const PoseScene scene = make_pose_scene({.noise_px = 0.6}, seed);
    const Rigid3 initial = perturb(scene.rig_from_world, 0.05, 0.01, seed);
    PoseWorkspace workspace;
    const auto estimate = run(scene, initial, workspace);
    ASSERT_GE(estimate.num_inliers + 1, scene.observations.size());
    const Rigid3 expected = solve_with_ceres(scene, initial, 1.8);
    const Vector6d sigma = estimate.covariance.diagonal().cwiseSqrt();
    const Vector6d difference = error_of(estimate.rig_from_world, expected);
    EXPECT_LT(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.02) << seed;
  }
}

TEST(Pose, RejectsHalfOfTheObservationsFromSeveralPixelsAway) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const PoseScene scene =
        make_pose_scene({.num_cameras = 1 + seed % 2, .share_of_outliers = 0.5}, seed);
    PoseWorkspace workspace;
    // 0.03 rad are 12 px of the finest level.
    const auto estimate = run(scene, perturb(scene.rig_from_world, 0.05, 0.02, seed), workspace);
    const Vector6d error = error_of(estimate.rig_from_world, scene.rig_from_world);
    EXPECT_LT(error.head<3>().norm(), 0.05) << seed;
    EXPECT_LT(error.tail<3>().norm(), 0.003) << seed;
    std::size_t num_wrong = 0;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      num_wrong += scene.is_inlier[i] != estimate.is_inlier[i];
    }
    EXPECT_LT(num_wrong, scene.is_inlier.size() / 12) << seed;
  }
}

/// Mean of the normalised squared error over runs; 6 if the covariance is right. Ranges are told to
/// be so many times as uncertain as they are.
double mean_nees(const testing::PoseSceneOptions& options, float told_range_sigmas = 1.0f) {
  const int num_runs = 60;
  double sum = 0.0;
  PoseWorkspace workspace;
  for (std::uint64_t seed = 0; seed < num_runs; ++seed) {
    PoseScene scene = make_pose_scene(options, 100 + seed);
    for (float& sigma : scene.observations.inverse_range_sigma) sigma *= told_range_sigmas;
    const auto estimate = run(scene, perturb(scene.rig_from_world, 0.03, 0.005, seed), workspace);
    const Vector6d error = error_of(estimate.rig_from_world, scene.rig_from_world);
    sum += error.dot(estimate.covariance.ldlt().solve(error));
  }
  return sum / num_runs;
}

TEST(Pose, CovarianceIsHonest) {
  for (const double noise_px : {0.3, 0.6, 1.0}) {
    const double nees = mean_nees({.noise_px = noise_px});
    EXPECT_GT(nees, 4.0) << noise_px;
    EXPECT_LT(nees, 9.0) << noise_px;
  }
  const double stereo = mean_nees({.num_cameras = 2, .share_of_outliers = 0.3});
  EXPECT_GT(stereo, 3.0);
  EXPECT_LT(stereo, 12.0);
  for (const float told : {0.7f, 1.0f, 4.0f}) {
    const double ranges = mean_nees({.noise_px = 0.5, .range_sigma = 0.001}, told);
    EXPECT_GT(ranges, 4.0) << told;
    EXPECT_LT(ranges, 9.0) << told;
  }
  const double few = mean_nees({.num_observations = 15, .noise_px = 0.7});
  EXPECT_GT(few, 3.0);
  EXPECT_LT(few, 12.0);
}

TEST(Pose, RangesAddInformationAndWrongOnesAreDiscounted) {
  PoseScene scene = make_pose_scene({.num_observations = 200, .range_sigma = 0.002}, 5);
  const Rigid3 initial = perturb(scene.rig_from_world, 0.05, 0.01, 5);
  PoseWorkspace workspace;
  const auto with = run(scene, initial, workspace);
  EXPECT_LT(error_of(with.rig_from_world, scene.rig_from_world).norm(), 0.02);
  for (std::size_t i = 0; i < scene.observations.size(); i += 3) {
    scene.observations.inverse_range[i] *= 2.0f;
  }
  const auto wrong = run(scene, initial, workspace);
  EXPECT_LT(error_of(wrong.rig_from_world, scene.rig_from_world).norm(), 0.03);
  EXPECT_GT(wrong.num_inliers, 180u);
  scene.observations.inverse_range_sigma.assign(scene.observations.size(), 0.0f);
  const auto without = run(scene, initial, workspace);
  EXPECT_GT(without.covariance.trace(), with.covariance.trace());
}

TEST(Pose, ThePointBehindIsAnOutlier) {
  PoseScene scene = make_pose_scene({.num_observations = 60, .noise_px = 0.2}, 7);
  const Rigid3 world_from_rig = scene.rig_from_world.inverse();
  for (std::size_t i = 0; i < 10; ++i) {
    const Eigen::Vector3d point_in_rig =
        scene.rig_from_world * scene.observations.point_in_world[i];
    scene.observations.point_in_world[i] = world_from_rig * (-point_in_rig).eval();
  }
  PoseWorkspace workspace;
  const auto estimate = run(scene, scene.rig_from_world, workspace);
  EXPECT_EQ(estimate.num_inliers, 50u);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_FALSE(estimate.is_inlier[i]);
}

TEST(Pose, SameInputSameBits) {
  const PoseScene scene = make_pose_scene({.num_cameras = 2, .share_of_outliers = 0.4}, 8);
  const PoseScene other = make_pose_scene({.num_observations = 500}, 9);
  const Rigid3 initial = perturb(scene.rig_from_world, 0.05, 0.01, 8);
  PoseWorkspace workspace;
  const auto first = run(scene, initial, workspace);
  run(other, other.rig_from_world, workspace);
  const auto second = run(scene, initial, workspace);
  EXPECT_EQ(first.rig_from_world.translation, second.rig_from_world.translation);
  EXPECT_EQ(first.rig_from_world.rotation.coeffs(), second.rig_from_world.rotation.coeffs());
  EXPECT_EQ(first.covariance, second.covariance);
}

void expect_finite(const PoseEstimate& estimate) {
  EXPECT_TRUE(estimate.rig_from_world.translation.allFinite());
  EXPECT_TRUE(estimate.rig_from_world.rotation.coeffs().allFinite());
  EXPECT_TRUE(estimate.covariance.allFinite());
  EXPECT_TRUE((estimate.covariance.diagonal().array() >= 0.0).all());
}

TEST(Pose, DegenerateInputStaysFinite) {
  PoseScene scene = make_pose_scene({.num_observations = 40}, 10);
  const Rigid3 truth = scene.rig_from_world;
  PoseWorkspace workspace;
  PoseScene empty = scene;
  empty.observations.clear();
  const auto nothing = run(empty, truth, workspace);
  expect_finite(nothing);
  EXPECT_EQ(nothing.num_inliers, 0u);
  EXPECT_EQ(nothing.rig_from_world.translation, truth.translation);
  EXPECT_GT(nothing.covariance(0, 0), 1e5);

  PoseScene one_place = scene;
  for (auto& point : one_place.observations.point_in_world) {
    point = scene.observations.point_in_world[0];
  }
  one_place.observations.bearing.assign(40, scene.observations.bearing[0]);
  one_place.observations.level_pixel_from_bearing.assign(
      40, scene.observations.level_pixel_from_bearing[0]);
  expect_finite(run(one_place, perturb(truth, 0.05, 0.01, 10), workspace));

  PoseScene at_centre = scene;
  for (auto& point : at_centre.observations.point_in_world) point = truth.origin_in_source();
  expect_finite(run(at_centre, truth, workspace));
}

TEST(Pose, HostileValuesAreOutliers) {
  PoseScene scene = make_pose_scene({.num_observations = 60, .range_sigma = 0.01}, 11);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto& observations = scene.observations;
  observations.point_in_world[0].x() = nan;
  observations.point_in_world[1].setConstant(1e200);
  observations.bearing[2].x() = std::numeric_limits<float>::infinity();
  observations.level_pixel_from_bearing[3](0, 0) = static_cast<float>(nan);
  observations.level_pixel_from_bearing[4].setConstant(1e38f);
  observations.camera[5] = 7;
  observations.inverse_range[6] = static_cast<float>(nan);
  observations.inverse_range_sigma[7] = static_cast<float>(nan);
  observations.inverse_range_sigma[8] = -1.0f;
  observations.inverse_range_sigma[9] = 1e-38f;
  PoseWorkspace workspace;
  const auto estimate = run(scene, perturb(scene.rig_from_world, 0.02, 0.005, 11), workspace);
  expect_finite(estimate);
  EXPECT_LT(error_of(estimate.rig_from_world, scene.rig_from_world).norm(), 0.1);
  for (const std::size_t i : {0u, 1u, 2u, 3u, 4u, 5u}) EXPECT_FALSE(estimate.is_inlier[i]) << i;
}

TEST(Pose, ArraysOfDifferentSizesBreakThePromise) {
  PoseScene scene = make_pose_scene({}, 12);
  scene.observations.bearing.pop_back();
  PoseWorkspace workspace;
  EXPECT_THROW(run(scene, scene.rig_from_world, workspace), CheckError);
}

}  // namespace
}  // namespace waymark

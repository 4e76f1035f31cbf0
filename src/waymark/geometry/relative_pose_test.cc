// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/relative_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/essential.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::make_scene;
using testing::random_direction;
using testing::random_pose;
using testing::TwoViewScene;
using testing::View;

TwoViewScene scene_all_round(std::size_t num_matches, double sigma_rad, double outliers, Rng& rng) {
  return make_scene(
      random_pose(rng, rng.uniform(0.0, 3.0), 1.0),
      View{true},
      num_matches,
      sigma_rad,
      outliers,
      rng,
      [](Rng& r) { return Eigen::Vector3d(r.uniform(1.0, 6.0) * random_direction(r)); });
}

TEST(EpipolarResidual, JacobianMatchesNumericDerivative) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 100; ++trial) {
    TwoViewScene scene = scene_all_round(1, 0.01, 0.0, rng);
    scene.sigmas_rad_a[0] = 0.02;  // unequal, and large, so that every term shows
    scene.sigmas_rad_b[0] = 0.05;
    if (trial % 2 == 0) scene.bearings_b[0] = random_direction(rng);  // an outlier
    const EpipolarResidual residual = epipolar_residual(scene.b_from_a, scene.matches(), 0);
    const double step = 1e-6;
    for (int k = 0; k < 5; ++k) {
      const Vector5d delta = step * Vector5d::Unit(k);
      const auto value = [&](const Vector5d& tangent) {
        const Rigid3 moved = perturb_relative_pose(scene.b_from_a, tangent);
        return epipolar_residual(moved, scene.matches(), 0).value;
      };
      const double numeric = (value(delta) - value(-delta)) / (2.0 * step);
      EXPECT_NEAR(residual.jacobian[k], numeric, 1e-6 * (1.0 + residual.jacobian.norm()));
    }
    EXPECT_NEAR(residual.value * residual.value,
                squared_epipolar_error(essential_from_pose(scene.b_from_a), scene.matches(), 0),
                1e-9 * (1.0 + residual.value * residual.value));
  }
}

TEST(EpipolarResidual, IsChiSquaredOfOneDegreeForTrueMatches) {
  Rng rng(2, 0);
  double sum = 0.0;
  std::size_t count = 0, num_beyond = 0;
  for (int trial = 0; trial < 10; ++trial) {
    TwoViewScene scene = scene_all_round(400, 0.002, 0.0, rng);
    const Eigen::Matrix3d essential = essential_from_pose(scene.b_from_a);
    for (std::size_t i = 0; i < 400; ++i) {
      const double squared_error = squared_epipolar_error(essential, scene.matches(), i);
      sum += squared_error;
      num_beyond += squared_error > 3.84;
      ++count;
    }
  }
  const double n = static_cast<double>(count);
  EXPECT_NEAR(sum / n, 1.0, 4.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(static_cast<double>(num_beyond) / n, 0.05, 4.0 * std::sqrt(0.05 * 0.95 / n));
}

TEST(EpipolarResidual, StaysFiniteAtTheEpipole) {
  const Rigid3 forward(Eigen::Quaterniond::Identity(), {0.0, 0.0, -1.0});
  const std::vector<Eigen::Vector3d> ahead = {Eigen::Vector3d::UnitZ()};
  const std::vector<double> sigma = {0.001};
  const EpipolarResidual residual = epipolar_residual(forward, {ahead, ahead, sigma, sigma}, 0);
  EXPECT_EQ(residual.value, 0.0);
  EXPECT_TRUE(residual.jacobian.allFinite());
}

TEST(RefineRelativePose, ReachesTheTruthWithoutNoise) {
  Rng rng(3, 0);
  for (int trial = 0; trial < 30; ++trial) {
    TwoViewScene scene = scene_all_round(40, 0.0, 0.0, rng);
    scene.sigmas_rad_a.assign(40, 0.1);
    scene.sigmas_rad_b.assign(40, 0.1);
    Vector5d offset;
    for (int k = 0; k < 5; ++k) offset[k] = 0.03 * rng.normal();
    const Rigid3 start = perturb_relative_pose(scene.b_from_a, offset);
    const Rigid3 refined = refine_relative_pose(start, scene.matches(), scene.indices(), {});
    EXPECT_LT(testing::rotation_error_rad(refined, scene.b_from_a), 1e-6);
    EXPECT_LT(testing::direction_error_rad(refined, scene.b_from_a), 1e-6);
  }
}

TEST(RefineRelativePose, OutliersHaveNoPull) {
  Rng rng(4, 0);
  for (int trial = 0; trial < 20; ++trial) {
    const TwoViewScene scene = scene_all_round(300, 0.001, 0.3, rng);
    Vector5d offset;
    for (int k = 0; k < 5; ++k) offset[k] = 0.001 * rng.normal();
    const Rigid3 start = perturb_relative_pose(scene.b_from_a, offset);
    const Rigid3 refined = refine_relative_pose(start, scene.matches(), scene.indices(), {});
    EXPECT_LT(testing::rotation_error_rad(refined, scene.b_from_a), 1e-3);
    EXPECT_LT(testing::direction_error_rad(refined, scene.b_from_a), 3e-3);
  }
}

// The errors over many noisy trials, whitened by the information, have unit variance.
TEST(RelativePoseInformation, IsThatOfTheErrors) {
  Rng rng(6, 0);
  double sum = 0.0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    const TwoViewScene scene = scene_all_round(100, 0.002, 0.0, rng);
    const RefinementOptions least_squares{.first_scale = 1e3, .last_scale = 1e3};
    const Rigid3 refined =
        refine_relative_pose(scene.b_from_a, scene.matches(), scene.indices(), least_squares);
    Vector5d error;
    error << so3_log(scene.b_from_a.rotation * refined.rotation.conjugate()),
        tangent_basis(refined.translation).transpose() * scene.b_from_a.translation;
    const Matrix5d information =
        relative_pose_information(refined, scene.matches(), scene.indices());
    sum += error.dot(information * error);
  }
  // Chi-squared of 5 degrees of freedom; four standard deviations of its mean.
  EXPECT_NEAR(sum / kTrials, 5.0, 4.0 * std::sqrt(10.0 / kTrials));
}

TEST(RefineRelativePose, LeavesThePoseWithoutMatches) {
  Rng rng(5, 0);
  const TwoViewScene scene = scene_all_round(5, 0.001, 0.0, rng);
  const Rigid3 refined = refine_relative_pose(scene.b_from_a, scene.matches(), {}, {});
  EXPECT_EQ(refined.translation, scene.b_from_a.translation);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/similarity.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "waymark/geometry/rigid3.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

using testing::measure;
using testing::random_vector;

struct SceneOptions {
  std::size_t num_matches = 150;
  bool sees_all = false;
  double noise_px = 1.0;
  double point_noise = 0.0;  ///< Relative error of the range of each landmark.
  double share_of_outliers = 0.0;
  double scale = 1.0;
  double distance = 0.4;  ///< Of the cameras, per axis, in the units of b.
};

struct Scene {
  Sim3 b_from_a;
  LandmarkMatches matches;
  std::vector<std::uint8_t> is_inlier;
};

void append(LandmarkMatches::Side& side,
            const Eigen::Vector3d& point_in_cam,
            const SceneOptions& options,
            Rng& rng) {
  const auto measurement = measure(point_in_cam, options.noise_px, rng);
  side.point_in_cam.push_back((1.0 + options.point_noise * rng.normal()) * point_in_cam);
  side.bearing.push_back(measurement.bearing);
  side.level_pixel_from_bearing.push_back(measurement.level_pixel_from_bearing);
}

Eigen::Vector3d draw_point(const SceneOptions& options, Rng& rng) {
  const double range = rng.uniform(2.0, 12.0);
  if (options.sees_all) return range * random_vector(rng, 1.0).normalized();
  const double x = rng.uniform(-0.8, 0.8);
  return range * Eigen::Vector3d(x, rng.uniform(-0.6, 0.6), 1.0).normalized();
}

Scene make_scene(const SceneOptions& options, std::uint64_t seed) {
  Rng rng(seed, 0);
  Scene scene;
  const double angle = options.sees_all ? 1.0 : 0.1;
  scene.b_from_a = {
      so3_exp(random_vector(rng, angle)), random_vector(rng, options.distance), options.scale};
  for (std::size_t i = 0; i < options.num_matches; ++i) {
    const Eigen::Vector3d point_in_a = draw_point(options, rng);
    const bool is_outlier = rng.uniform() < options.share_of_outliers;
    append(scene.matches.a, point_in_a, options, rng);
    append(scene.matches.b,
           is_outlier ? options.scale * draw_point(options, rng) : scene.b_from_a * point_in_a,
           options,
           rng);
    scene.is_inlier.push_back(!is_outlier);
  }
  return scene;
}

Vector7d error_of(const Sim3& estimate, const Sim3& truth) {
  return (estimate * truth.inverse()).log();
}

Sim3 perturb(const Sim3& similarity, double sigma, std::uint64_t seed) {
  Rng rng(seed, 7);
  Vector7d tangent;
  tangent << random_vector(rng, sigma), random_vector(rng, sigma), sigma * rng.normal();
  return Sim3::exp(tangent) * similarity;
}

TEST(Similarity, JacobianMatchesNumericDerivative) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Scene scene = make_scene({.num_matches = 5, .sees_all = true, .scale = 1.7}, seed);
    const Sim3 b_from_a = perturb(scene.b_from_a, 0.05, seed);
    for (std::size_t i = 0; i < scene.matches.size(); ++i) {
      const auto residual = similarity_residual(b_from_a, scene.matches, i);
      ASSERT_TRUE(residual);
      const double step = 1e-6;
      for (int k = 0; k < 7; ++k) {
        const Vector7d delta = step * Vector7d::Unit(k);
        const auto above = similarity_residual(Sim3::exp(delta) * b_from_a, scene.matches, i);
        const auto below = similarity_residual(Sim3::exp(-delta) * b_from_a, scene.matches, i);
        ASSERT_TRUE(above && below);
        const Eigen::Vector4d numeric = (above->value - below->value) / (2.0 * step);
        EXPECT_LT((residual->jacobian.col(k) - numeric).norm(), 1e-5) << seed << ' ' << k;
        const double range_numeric =
            (above->log_range_ratio - below->log_range_ratio) / (2.0 * step);
        EXPECT_NEAR(residual->log_range_jacobian[k], range_numeric, 1e-8) << seed << ' ' << k;
      }
    }
  }
}

TEST(Similarity, IsExactWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const double scale = std::exp(0.2 * static_cast<double>(seed) - 2.0);
    const Scene scene =
        make_scene({.sees_all = seed % 2 == 0, .noise_px = 0.0, .scale = scale}, seed);
    const auto estimate = find_similarity(scene.matches, {}, {});
    ASSERT_TRUE(estimate) << seed;
    // Measured bearings are single precision.
    EXPECT_LT(error_of(estimate->b_from_a, scene.b_from_a).norm(), 1e-5) << seed;
    EXPECT_EQ(estimate->num_inliers, scene.matches.size()) << seed;
  }
}

TEST(Similarity, FindsTheModelAmongOutliersAndUncertainLandmarks) {
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const bool is_scale_free = seed % 3 != 0;
    const Scene scene = make_scene({.sees_all = seed % 2 == 0,
                                    .point_noise = 0.01,
                                    .share_of_outliers = 0.6,
                                    .scale = is_scale_free ? 0.6 : 1.0},
                                   seed);
    const auto estimate = find_similarity(scene.matches,
                                          {.is_scale_free = is_scale_free, .noise_px = 1.2},
                                          {.seed = seed, .min_inlier_ratio = 0.2});
    ASSERT_TRUE(estimate) << seed;
    const Vector7d error = error_of(estimate->b_from_a, scene.b_from_a);
    EXPECT_LT(error.head<3>().norm(), 0.05) << seed;
    EXPECT_LT(error.segment<3>(3).norm(), 0.005) << seed;
    // Four deviations of the mean of 60 ratios of landmarks that are off by 1 % each.
    EXPECT_LT(std::abs(error[6]), 0.0075) << seed;
    std::size_t num_false = 0, num_true = 0;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      num_false += estimate->is_inlier[i] && !scene.is_inlier[i];
      num_true += estimate->is_inlier[i] && scene.is_inlier[i];
    }
    EXPECT_EQ(estimate->num_inliers, num_false + num_true);
    EXPECT_LE(num_false, 1u) << seed;
    EXPECT_GT(num_true, 40u) << seed;
  }
}

TEST(Similarity, TellsTheScaleFromTheSamePlace) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Scene scene = make_scene(
        {.point_noise = 0.03, .share_of_outliers = 0.4, .scale = 1.4, .distance = 0.0}, seed);
    const auto estimate =
        find_similarity(scene.matches, {}, {.seed = seed, .min_inlier_ratio = 0.2});
    ASSERT_TRUE(estimate) << seed;
    // Two landmarks of 3 % each in 90 pairs.
    EXPECT_NEAR(estimate->range_noise, 0.042, 0.02) << seed;
    const double error = error_of(estimate->b_from_a, scene.b_from_a)[6];
    EXPECT_LT(std::abs(error), 0.02) << seed;
    EXPECT_LT(std::abs(error), 4.0 * std::sqrt(estimate->covariance(6, 6))) << seed;
  }
}

TEST(Similarity, AFixedScaleIsExactlyOne) {
  const Scene scene = make_scene({.scale = 1.02}, 1);
  const auto estimate = find_similarity(scene.matches, {.is_scale_free = false}, {});
  ASSERT_TRUE(estimate);
  EXPECT_EQ(estimate->b_from_a.scale, 1.0);
  EXPECT_EQ(estimate->covariance(6, 6), 0.0);
}

TEST(Similarity, RefinementConvergesFromAfar) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Scene scene = make_scene({.share_of_outliers = 0.3, .scale = 1.5}, seed);
    const auto estimate = refine_similarity(scene.matches, perturb(scene.b_from_a, 0.05, seed), {});
    EXPECT_LT(error_of(estimate.b_from_a, scene.b_from_a).norm(), 0.05) << seed;
    EXPECT_GT(estimate.num_inliers, 80u) << seed;
  }
}

/// Autodiff residuals with their own formulas, parameters (angle axis, translation, log scale).
struct SimilarityOracle {
  Eigen::Vector3d point_a, point_b, bearing_a, bearing_b;
  Matrix23d w_a, w_b;

  template <class T>
  static void residual_of(const T* point,
                          const Eigen::Vector3d& bearing,
                          const Matrix23d& w,
                          T* residual) {
    using std::sqrt;
    const T range = sqrt(point[0] * point[0] + point[1] * point[1] + point[2] * point[2]);
    for (int row = 0; row < 2; ++row) {
      residual[row] = T(0.0);
      for (int i = 0; i < 3; ++i) residual[row] += w(row, i) * (point[i] / range - bearing[i]);
    }
  }

  template <class T>
  bool operator()(const T* similarity, T* residuals) const {
    using std::exp;
    const T scale = exp(similarity[6]);
    const T a[3] = {T(point_a.x()), T(point_a.y()), T(point_a.z())};
    T in_b[3], in_a[3], shifted[3], back[3];
    ceres::AngleAxisRotatePoint(similarity, a, in_b);
    for (int i = 0; i < 3; ++i) {
      in_b[i] = scale * in_b[i] + similarity[3 + i];
      shifted[i] = (point_b[i] - similarity[3 + i]) / scale;
      back[i] = -similarity[i];
    }
    ceres::AngleAxisRotatePoint(back, shifted, in_a);
    residual_of(in_b, bearing_b, w_b, residuals);
    residual_of(in_a, bearing_a, w_a, residuals + 2);
    return true;
  }
};

struct RangeOracle {
  Eigen::Vector3d point_a, point_b;
  double factor;

  template <class T>
  bool operator()(const T* similarity, T* residual) const {
    using std::exp;
    using std::log;
    const T a[3] = {T(point_a.x()), T(point_a.y()), T(point_a.z())};
    T in_b[3];
    ceres::AngleAxisRotatePoint(similarity, a, in_b);
    T squared(0.0);
    for (int i = 0; i < 3; ++i) {
      in_b[i] = exp(similarity[6]) * in_b[i] + similarity[3 + i];
      squared += in_b[i] * in_b[i];
    }
    residual[0] = 0.5 * factor * log(squared / point_b.squaredNorm());
    return true;
  }
};

Sim3 solve_with_ceres(const LandmarkMatches& matches, const Sim3& initial, double range_noise) {
  const double huber_scale = 2.5;
  double parameters[7];
  Eigen::Map<Eigen::Vector3d>(parameters + 0) = so3_log(initial.rotation);
  Eigen::Map<Eigen::Vector3d>(parameters + 3) = initial.translation;
  parameters[6] = std::log(initial.scale);
  ceres::Problem problem;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    auto* oracle = new SimilarityOracle{matches.a.point_in_cam[i],
                                        matches.b.point_in_cam[i],
                                        matches.a.bearing[i].cast<double>(),
                                        matches.b.bearing[i].cast<double>(),
                                        matches.a.level_pixel_from_bearing[i].cast<double>(),
                                        matches.b.level_pixel_from_bearing[i].cast<double>()};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SimilarityOracle, 4, 7>(oracle),
                             new ceres::HuberLoss(huber_scale),
                             parameters);
    auto* range_oracle =
        new RangeOracle{matches.a.point_in_cam[i], matches.b.point_in_cam[i], 1.0 / range_noise};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RangeOracle, 1, 7>(range_oracle),
                             new ceres::HuberLoss(huber_scale),
                             parameters);
  }
  ceres::Solver::Options options;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return {so3_exp(Eigen::Map<Eigen::Vector3d>(parameters)),
          Eigen::Map<Eigen::Vector3d>(parameters + 3),
          std::exp(parameters[6])};
}

TEST(Similarity, AgreesWithCeresAutodiff) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    // So little noise that every match passes the gate, and Huber's loss still matters.
    const Scene scene = make_scene({.noise_px = 0.65, .point_noise = 0.002, .scale = 1.3}, seed);
    const auto estimate = find_similarity(scene.matches, {.gate_chi2 = 30.0}, {});
    ASSERT_TRUE(estimate);
    ASSERT_EQ(estimate->num_inliers, scene.matches.size());
    const Sim3 expected = solve_with_ceres(scene.matches, scene.b_from_a, estimate->range_noise);
    const Vector7d sigma = estimate->covariance.diagonal().cwiseSqrt();
    const Vector7d difference = error_of(estimate->b_from_a, expected);
    EXPECT_LT(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.01) << seed;
  }
}

TEST(Similarity, CovarianceIsHonest) {
  const int num_runs = 40;
  double sum = 0.0;
  for (std::uint64_t seed = 0; seed < num_runs; ++seed) {
    const Scene scene =
        make_scene({.num_matches = 80, .point_noise = 0.005, .scale = 0.8}, 100 + seed);
    const auto estimate = find_similarity(scene.matches, {}, {});
    ASSERT_TRUE(estimate);
    const Vector7d error = error_of(estimate->b_from_a, scene.b_from_a);
    sum += error.dot(estimate->covariance.ldlt().solve(error));
  }
  // 7 on average if the covariance is right.
  EXPECT_GT(sum / num_runs, 5.0);
  EXPECT_LT(sum / num_runs, 10.0);
}

TEST(Similarity, NothingWithoutMatchesOrSupport) {
  EXPECT_FALSE(find_similarity({}, {}, {}));
  EXPECT_FALSE(find_similarity(make_scene({.num_matches = 3}, 1).matches, {}, {}));
  Scene scene = make_scene({}, 2);
  for (auto& point : scene.matches.a.point_in_cam) point = {point.z(), 0.0, 0.0};
  EXPECT_FALSE(find_similarity(scene.matches, {}, {}));  // On a line.
  scene = make_scene({.num_matches = 100, .share_of_outliers = 1.0}, 3);
  const auto estimate = find_similarity(scene.matches, {}, {.min_inlier_ratio = 0.2});
  EXPECT_TRUE(!estimate || estimate->num_inliers < 12);
}

TEST(Similarity, StaysFiniteOnHostileInput) {
  Scene scene = make_scene({}, 4);
  auto& [a, b] = scene.matches;
  for (std::size_t i = 0; i < 50; i += 5) {
    a.point_in_cam[i].x() = std::numeric_limits<double>::quiet_NaN();
    b.point_in_cam[i + 1].setZero();
    a.bearing[i + 2].y() = std::numeric_limits<float>::infinity();
    b.level_pixel_from_bearing[i + 3](0, 0) = std::numeric_limits<float>::quiet_NaN();
    a.point_in_cam[i + 4] *= 1e200;
  }
  const auto estimate = find_similarity(scene.matches, {}, {});
  ASSERT_TRUE(estimate);
  EXPECT_LT(error_of(estimate->b_from_a, scene.b_from_a).norm(), 0.05);
  EXPECT_GT(estimate->num_inliers, 85u);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_FALSE(estimate->is_inlier[i]) << i;
  EXPECT_TRUE(estimate->covariance.allFinite());

  const auto lost =
      refine_similarity(scene.matches, Sim3(so3_exp({3.0, 0.0, 0.0}), {9, 9, 9}, 1e-3), {});
  EXPECT_TRUE(lost.b_from_a.translation.allFinite());
  EXPECT_TRUE(lost.b_from_a.scale > 0.0 && std::isfinite(lost.b_from_a.scale));
  EXPECT_TRUE(lost.covariance.allFinite());
}

TEST(Similarity, GivesTheSameBitsTwice) {
  const Scene scene = make_scene({.share_of_outliers = 0.5}, 5);
  const auto first = find_similarity(scene.matches, {}, {.seed = 1});
  const auto second = find_similarity(scene.matches, {}, {.seed = 1});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->b_from_a.translation, second->b_from_a.translation);
  EXPECT_EQ(first->b_from_a.scale, second->b_from_a.scale);
  EXPECT_EQ(first->is_inlier, second->is_inlier);
}

}  // namespace
}  // namespace waymark

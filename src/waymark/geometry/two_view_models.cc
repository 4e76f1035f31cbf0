// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/geometry/essential.h"
#include "waymark/geometry/homography.h"
#include "waymark/geometry/relative_pose.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/geometry/two_view.h"

namespace waymark {
namespace {

template <std::size_t kSize>
std::array<Eigen::Vector3d, kSize> gather(std::span<const Eigen::Vector3d> bearings,
                                          std::span<const std::uint32_t, kSize> sample) {
  std::array<Eigen::Vector3d, kSize> result;
  for (std::size_t i = 0; i < kSize; ++i) result[i] = bearings[sample[i]];
  return result;
}

std::vector<Eigen::Matrix3d> as_list(const std::optional<Eigen::Matrix3d>& model) {
  if (!model) return {};
  return {*model};
}

// Every k-th of the indices such that about this many remain: local optimisation needs no more to
// find the right basin (Lebeda, Matas & Chum 2012, Fixing the Locally Optimized RANSAC).
std::vector<std::uint32_t> thin_out(std::span<const std::uint32_t> indices) {
  constexpr std::size_t kEnough = 300;
  const std::size_t stride = (indices.size() + kEnough - 1) / kEnough;
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < indices.size(); i += stride) result.push_back(indices[i]);
  return result;
}

// The three models as estimators for ransac(). Thresholds are the 95 % quantiles of chi-squared of
// 1 and 2 degrees of freedom.

template <std::size_t kSize>
struct MatchEstimator {
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = kSize;
  using Sample = std::span<const std::uint32_t, kSize>;
  using Indices = std::span<const std::uint32_t>;

  std::size_t num_data() const { return matches.size(); }

  BearingMatches matches;
};

// Essential matrices of any scene seen from two places.
struct EssentialEstimator : MatchEstimator<5> {
  static constexpr double kMaxSquaredError = kMaxSquaredEpipolarError;

  std::vector<Eigen::Matrix3d> fit(Sample sample) const {
    const auto bearings_a = gather(matches.bearings_a, sample);
    return solve_five_point(bearings_a, gather(matches.bearings_b, sample));
  }

  double squared_error(const Eigen::Matrix3d& essential, std::size_t index) const {
    return squared_epipolar_error(essential, matches, index);
  }

  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& essential, Indices nearby) const {
    if (nearby.size() <= kSampleSize) return std::nullopt;
    // The epipolar error is the same for all four poses of an essential matrix.
    const Rigid3 b_from_a = decompose_essential(essential).front();
    return essential_from_pose(
        refine_relative_pose(b_from_a, matches, thin_out(nearby), {.max_iterations = 6}));
  }
};

// Homographies of a plane seen from two places.
struct HomographyEstimator : MatchEstimator<4> {
  static constexpr double kMaxSquaredError = 5.99;

  std::vector<Eigen::Matrix3d> fit(Sample sample) const {
    const auto bearings_a = gather(matches.bearings_a, sample);
    return as_list(solve_four_point(bearings_a, gather(matches.bearings_b, sample)));
  }

  double squared_error(const Eigen::Matrix3d& homography, std::size_t index) const {
    return squared_homography_error(homography, matches, index);
  }

  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& homography, Indices nearby) const {
    return refine_homography(homography, matches, thin_out(nearby));
  }
};

// Rotations of any scene seen from one place, or of a scene far away.
struct RotationEstimator : MatchEstimator<2> {
  static constexpr double kMaxSquaredError = 5.99;

  std::vector<Eigen::Matrix3d> fit(Sample sample) const {
    const auto bearings_a = gather(matches.bearings_a, sample);
    return as_list(align_directions(bearings_a, gather(matches.bearings_b, sample)));
  }

  double squared_error(const Eigen::Matrix3d& rotation, std::size_t index) const {
    return (rotation * matches.bearings_a[index] - matches.bearings_b[index]).squaredNorm() /
           variance(index);
  }

  std::optional<Eigen::Matrix3d> refine(const Eigen::Matrix3d& rotation, Indices nearby) const {
    std::vector<Eigen::Vector3d> directions_a, directions_b;
    std::vector<double> weights;
    for (const std::uint32_t index : nearby) {
      directions_a.push_back(matches.bearings_a[index]);
      directions_b.push_back(matches.bearings_b[index]);
      weights.push_back(geman_mcclure_weight(squared_error(rotation, index), kMaxSquaredError) /
                        variance(index));
    }
    return align_directions(directions_a, directions_b, weights);
  }

  double variance(std::size_t index) const {
    return matches.sigmas_rad_a[index] * matches.sigmas_rad_a[index] +
           matches.sigmas_rad_b[index] * matches.sigmas_rad_b[index];
  }
};

struct ModelSize {
  int dimension;       // of the surface of all matches that fit, of 4 for any pair of directions
  int num_parameters;  // of the model
};

// The geometric robust information criterion: the sum over the matches of squared error +
// dimension * log 4, plus log(4 n) per parameter (Torr 1998, Geometric Motion Segmentation and
// Model Selection). A match costs no more than an outlier, which here is the same for each model
// (that of the essential matrix at its threshold): otherwise outliers would vote for the model that
// calls more of them so.
template <class Estimator>
double gric(const Estimator& estimator, const std::optional<TwoViewFit>& fit, ModelSize size) {
  if (!fit) return std::numeric_limits<double>::infinity();
  const double per_dimension = std::log(4.0);
  const double outlier_cost = kMaxSquaredEpipolarError + 3.0 * per_dimension;
  const double num_matches = static_cast<double>(estimator.num_data());
  double sum = size.num_parameters * std::log(4.0 * num_matches);
  for (std::size_t i = 0; i < estimator.num_data(); ++i) {
    const double cost = estimator.squared_error(fit->model, i) + size.dimension * per_dimension;
    sum += cost < outlier_cost ? cost : outlier_cost;
  }
  return sum;
}

}  // namespace

TwoViewModels fit_two_view_models(const BearingMatches& matches, RansacOptions options) {
  const EssentialEstimator essential{{matches}};
  const HomographyEstimator homography{{matches}};
  const RotationEstimator rotation{{matches}};
  TwoViewModels models;
  models.essential = ransac(essential, options);
  if (models.essential) {
    // A model of less support than this would lose to the essential matrix anyway.
    const double support = static_cast<double>(models.essential->inliers.size());
    options.min_inlier_ratio =
        std::max(options.min_inlier_ratio, 0.8 * support / static_cast<double>(matches.size()));
  }
  models.homography = ransac(homography, options);
  models.rotation = ransac(rotation, options);

  const double scene_cost = gric(essential, models.essential, {3, 5});
  const double plane_cost = gric(homography, models.homography, {2, 8});
  const double rotation_cost = gric(rotation, models.rotation, {2, 3});
  models.cost = std::min({scene_cost, plane_cost, rotation_cost});
  const std::optional<TwoViewFit>* best = &models.essential;
  if (plane_cost < scene_cost) {
    models.best = TwoViewModel::kPlane;
    best = &models.homography;
  }
  if (rotation_cost < std::min(scene_cost, plane_cost)) {
    models.best = TwoViewModel::kRotation;
    best = &models.rotation;
  }
  if (*best) models.num_inliers = (*best)->inliers.size();
  return models;
}

}  // namespace waymark

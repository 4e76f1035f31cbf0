// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/two_view.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "waymark/base/check.h"
#include "waymark/geometry/essential.h"
#include "waymark/geometry/homography.h"
#include "waymark/geometry/relative_pose.h"
#include "waymark/geometry/triangulation.h"

namespace waymark {
namespace {

// The cost of a match that contradicts a motion, in squared standard deviations.
constexpr double kOutlierCost = kMaxSquaredEpipolarError;
// With less support than this share of the matches, agreement may be chance.
constexpr double kMinInlierRatio = 0.4;
// Parallax in standard deviations from which a point counts as behind, and angles of its triangle
// from which it counts as a point.
constexpr double kBehindSigmas = 3.0;
constexpr double kPointSigmas = 4.0;
// Poses closer than this are one solution.
constexpr double kSameRotationRad = 0.02;
constexpr double kSameDirectionRad = 0.1;
// With a standard deviation of the direction of motion above this, the motion is not known.
constexpr double kMaxDirectionSigmaRad = 0.1;
// A rival is rejected if it is less likely by a factor of exp(10 / 2) and, since a few wrong
// matches can do that by chance, by so many standard deviations of the difference.
constexpr double kMinCostGap = 10.0;
constexpr double kMinVuongSigmas = 3.0;

double parallax_sigma_rad(const BearingMatches& matches, std::size_t index) {
  return std::hypot(matches.sigmas_rad_a[index], matches.sigmas_rad_b[index]);
}

// --- Which motion ---

struct Candidate {
  Rigid3 b_from_a;
  std::vector<double> match_costs;  // at most kOutlierCost each
  double cost = 0.0;
};

bool is_behind(const BearingMatches& matches, std::size_t index, const Rigid3& a_from_b) {
  const Eigen::Vector3d& a = matches.bearings_a[index];
  const Eigen::Vector3d& b = matches.bearings_b[index];
  const double threshold = kBehindSigmas * parallax_sigma_rad(matches, index);
  return a.cross(a_from_b.rotation * b).norm() > threshold && !triangulate(a, b, a_from_b, 0.0);
}

Candidate make_candidate(const Rigid3& b_from_a, const BearingMatches& matches) {
  Candidate candidate{b_from_a, {}, 0.0};
  candidate.match_costs.resize(matches.size());
  const Eigen::Matrix3d essential = essential_from_pose(b_from_a);
  const Rigid3 a_from_b = b_from_a.inverse();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double squared_error = squared_epipolar_error(essential, matches, i);
    const bool is_consistent = squared_error < kOutlierCost && !is_behind(matches, i, a_from_b);
    candidate.match_costs[i] = is_consistent ? squared_error : kOutlierCost;
    candidate.cost += candidate.match_costs[i];
  }
  return candidate;
}

// On all matches. The models are good enough to start from with a narrow loss.
Rigid3 refine(const Rigid3& b_from_a, const BearingMatches& matches) {
  std::vector<std::uint32_t> all(matches.size());
  std::iota(all.begin(), all.end(), 0u);
  const Rigid3 start(b_from_a.rotation, b_from_a.translation.normalized());
  return refine_relative_pose(start, matches, all, {.first_scale = 3.0, .max_iterations = 15});
}

// Of the motions past a plane, those that have most of its points on the visible side.
std::vector<Rigid3> visible_motions(const TwoViewFit& homography, const BearingMatches& matches) {
  std::vector<Rigid3> motions;
  for (const PlanarMotion& motion : decompose_homography(homography.model)) {
    if (!(motion.b_from_a.translation.norm() > 0.0)) continue;
    const auto num_visible = std::count_if(
        homography.inliers.begin(), homography.inliers.end(), [&](std::uint32_t index) {
          return motion.normal_in_a.dot(matches.bearings_a[index]) > 0.0;
        });
    if (2 * static_cast<std::size_t>(num_visible) > homography.inliers.size()) {
      motions.push_back(motion.b_from_a);
    }
  }
  return motions;
}

// The motions that the matches allow, best first.
std::vector<Candidate> find_candidates(const TwoViewModels& models, const BearingMatches& matches) {
  std::vector<Candidate> candidates;
  if (models.essential) {
    const Rigid3 refined = refine(decompose_essential(models.essential->model).front(), matches);
    for (const Rigid3& b_from_a : decompose_essential(essential_from_pose(refined))) {
      candidates.push_back(make_candidate(b_from_a, matches));
    }
  }
  if (models.homography && 2 * models.homography->inliers.size() > models.num_inliers) {
    for (const Rigid3& motion : visible_motions(*models.homography, matches)) {
      candidates.push_back(make_candidate(refine(motion, matches), matches));
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.cost < b.cost;
  });
  return candidates;
}

bool is_same(const Rigid3& first, const Rigid3& second) {
  return first.rotation.angularDistance(second.rotation) < kSameRotationRad &&
         angle_between(first.translation, second.translation) < kSameDirectionRad;
}

// Whether the matches prefer a candidate to its rival beyond chance: Vuong 1989 (Likelihood Ratio
// Tests for Model Selection and Non-nested Hypotheses), costs being -2 log likelihoods.
bool is_significantly_better(const Candidate& candidate, const Candidate& rival) {
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (std::size_t i = 0; i < candidate.match_costs.size(); ++i) {
    const double difference = rival.match_costs[i] - candidate.match_costs[i];
    sum += difference;
    sum_of_squares += difference * difference;
  }
  return sum > kMinCostGap && sum > kMinVuongSigmas * std::sqrt(sum_of_squares);
}

bool is_ambiguous(const std::vector<Candidate>& candidates) {
  const Candidate& best = candidates.front();
  return std::any_of(candidates.begin() + 1, candidates.end(), [&](const Candidate& rival) {
    return !is_same(best.b_from_a, rival.b_from_a) && !is_significantly_better(best, rival);
  });
}

// Whether the matches fix the direction of motion: its standard deviation, whatever the rotation.
bool is_determined(const Candidate& candidate, const BearingMatches& matches) {
  std::vector<std::uint32_t> inliers;
  for (std::uint32_t i = 0; i < candidate.match_costs.size(); ++i) {
    if (candidate.match_costs[i] < kOutlierCost) inliers.push_back(i);
  }
  const Matrix5d information = relative_pose_information(candidate.b_from_a, matches, inliers);
  const Eigen::Matrix3d of_rotation = information.topLeftCorner<3, 3>();
  const Eigen::Matrix<double, 3, 2> mixed = information.topRightCorner<3, 2>();
  const Eigen::Matrix2d of_direction =
      information.bottomRightCorner<2, 2>() - mixed.transpose() * of_rotation.inverse() * mixed;
  if (!of_direction.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(of_direction, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] * kMaxDirectionSigmaRad * kMaxDirectionSigmaRad > 1.0;
}

// --- The points ---

// The triangle of both centres and the point has known angles if none of its sines is lost in
// noise. Near zero parallax the distances are unknown; a bearing near the epipole without the other
// means a point in the other view's centre.
bool is_triangle_certain(const BearingMatches& matches, std::size_t index, const Rigid3& a_from_b) {
  const Eigen::Vector3d& ray_a = matches.bearings_a[index];
  const Eigen::Vector3d ray_b = a_from_b.rotation * matches.bearings_b[index];
  const Eigen::Vector3d& t = a_from_b.translation;
  const double min_sine = kPointSigmas * parallax_sigma_rad(matches, index);
  return ray_a.cross(ray_b).norm() > min_sine && ray_a.cross(t).norm() > min_sine &&
         ray_b.cross(t).norm() > min_sine;
}

TwoViewGeometry make_geometry(const Candidate& candidate,
                              TwoViewModel model,
                              const BearingMatches& matches) {
  const std::size_t num_matches = matches.size();
  TwoViewGeometry geometry;
  geometry.b_from_a = candidate.b_from_a;
  geometry.model = model;
  geometry.is_inlier.resize(num_matches, 0);
  geometry.has_point.resize(num_matches, 0);
  geometry.points_in_a.resize(num_matches, Eigen::Vector3d::Zero());
  geometry.parallaxes_rad.resize(num_matches, 0.0);
  const Rigid3 a_from_b = candidate.b_from_a.inverse();
  for (std::size_t i = 0; i < num_matches; ++i) {
    if (!(candidate.match_costs[i] < kOutlierCost)) continue;
    const Eigen::Vector3d& a = matches.bearings_a[i];
    const Eigen::Vector3d& b = matches.bearings_b[i];
    geometry.is_inlier[i] = 1;
    geometry.parallaxes_rad[i] = parallax_angle(a, b, a_from_b);
    if (!is_triangle_certain(matches, i, a_from_b)) continue;
    const auto point = triangulate(a, b, a_from_b, 0.0);
    if (!point) continue;
    geometry.has_point[i] = 1;
    geometry.points_in_a[i] = *point;
  }
  return geometry;
}

int count_near_points(const TwoViewGeometry& geometry, double min_parallax_rad) {
  int count = 0;
  for (std::size_t i = 0; i < geometry.has_point.size(); ++i) {
    count += geometry.has_point[i] && geometry.parallaxes_rad[i] >= min_parallax_rad;
  }
  return count;
}

double enough_inliers(std::size_t num_matches, const TwoViewOptions& options) {
  return std::max<double>(options.min_num_points,
                          kMinInlierRatio * static_cast<double>(num_matches));
}

// Whether a motion has so many inliers and the parallax that it takes.
TwoViewResult judge(const Candidate& candidate,
                    TwoViewModel model,
                    const BearingMatches& matches,
                    double min_num_inliers,
                    const TwoViewOptions& options) {
  TwoViewGeometry geometry = make_geometry(candidate, model, matches);
  const auto num_inliers =
      std::count(geometry.is_inlier.begin(), geometry.is_inlier.end(), std::uint8_t{1});
  if (static_cast<double>(num_inliers) < min_num_inliers) {
    return {TwoViewStatus::kTooFewInliers, std::nullopt};
  }
  if (count_near_points(geometry, options.min_parallax_rad) < options.min_num_points ||
      !is_determined(candidate, matches)) {
    return {TwoViewStatus::kTooLittleParallax, std::nullopt};
  }
  return {TwoViewStatus::kOk, std::move(geometry)};
}

}  // namespace

TwoViewResult estimate_two_view(const BearingMatches& matches, const TwoViewOptions& options) {
  const std::size_t num_matches = matches.size();
  WAYMARK_CHECK(matches.bearings_b.size() == num_matches);
  WAYMARK_CHECK(matches.sigmas_rad_a.size() == num_matches);
  WAYMARK_CHECK(matches.sigmas_rad_b.size() == num_matches);
  if (num_matches < static_cast<std::size_t>(std::max(options.min_num_points, 5))) {
    return {TwoViewStatus::kTooFewMatches, std::nullopt};
  }
  const TwoViewModels models = fit_two_view_models(
      matches,
      {.seed = options.seed, .stream = options.stream, .min_inlier_ratio = kMinInlierRatio});
  const double enough = enough_inliers(num_matches, options);
  if (static_cast<double>(models.num_inliers) < enough) {
    return {TwoViewStatus::kTooFewInliers, std::nullopt};
  }
  if (models.best == TwoViewModel::kRotation) {
    return {TwoViewStatus::kTooLittleParallax, std::nullopt};
  }
  const std::vector<Candidate> candidates = find_candidates(models, matches);
  if (candidates.empty()) return {TwoViewStatus::kTooLittleParallax, std::nullopt};

  TwoViewResult result = judge(candidates.front(), models.best, matches, enough, options);
  if (result.geometry && is_ambiguous(candidates)) return {TwoViewStatus::kAmbiguous, std::nullopt};
  return result;
}

}  // namespace waymark

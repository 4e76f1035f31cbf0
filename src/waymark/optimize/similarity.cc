// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "waymark/base/median.h"
#include "waymark/geometry/alignment.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/levenberg_marquardt.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

/// Fewer do not determine a similarity.
constexpr std::size_t kMinMatches = 3;
/// Scales of the losses in units of the noise.
constexpr double kSimilarityFinalScale = 3.0;
constexpr double kSimilarityHuberScale = 2.5;
/// The scale shrinks by this factor from stage to stage.
constexpr double kSimilarityAnnealing = 0.5;
constexpr int kSimilarityIterationsPerStage = 3;
constexpr int kSimilarityIterationsPerRound = 10;
constexpr int kNumSimilarityRounds = 3;
/// Iterations end when the next step would lower the cost by less than this, in units of the
/// squared noise.
constexpr double kNegligibleSimilarityDecrease = 1e-6;
/// Noise of the logarithm of a ratio of ranges: as assumed until it is measured, and its bounds.
constexpr double kAssumedRangeNoise = 0.1;
constexpr double kMinRangeNoise = 0.002;
constexpr double kMaxRangeNoise = 0.5;
/// Standard deviation of a normal distribution by its median absolute deviation.
constexpr double kSigmaFromMedian = 1.4826;

/// One camera's view of the other's landmark.
struct SideView {
  InverseRangePoint seen;
  Eigen::Vector2d residual;
};

std::optional<SideView> view(const Eigen::Vector3d& point_in_cam,
                             const LandmarkMatches::Side& side,
                             std::size_t index) {
  const InverseRangePoint seen = in_inverse_range(point_in_cam);
  if (!is_ahead(seen, side.bearing[index])) return std::nullopt;
  const Eigen::Vector2d residual =
      bearing_residual(seen, side.bearing[index], side.level_pixel_from_bearing[index]);
  if (!residual.allFinite()) return std::nullopt;
  return SideView{seen, residual};
}

/// Derivatives of what depends on a point by a left perturbation that acts on that, which is moved
/// by rho + phi x p + sigma p: by_point * (I, -skew(p), p).
template <int kRows>
Eigen::Matrix<double, kRows, 7> by_perturbation(const Eigen::Matrix<double, kRows, 3>& by_point,
                                                const Eigen::Vector3d& point) {
  Eigen::Matrix<double, kRows, 7> result;
  result.template leftCols<3>() = by_point;
  result.col(3) = by_point.col(2) * point.y() - by_point.col(1) * point.z();
  result.col(4) = by_point.col(0) * point.z() - by_point.col(2) * point.x();
  result.col(5) = by_point.col(1) * point.x() - by_point.col(0) * point.y();
  result.col(6).noalias() = by_point * point;
  return result;
}

/// A similarity with what the residuals of all matches need of it.
struct BothWays {
  explicit BothWays(const Sim3& similarity)
      : b_from_a(similarity),
        a_from_b(similarity.inverse()),
        linear_a_from_b(a_from_b.scale * a_from_b.rotation.toRotationMatrix()) {}

  const Sim3& b_from_a;
  Sim3 a_from_b;
  Eigen::Matrix3d linear_a_from_b;
};

/// See similarity_residual(). Without the ratio of the ranges where is_scale_free is not set.
std::optional<SimilarityResidual> residual_of(const BothWays& similarity,
                                              const LandmarkMatches& matches,
                                              std::size_t index,
                                              bool is_scale_free) {
  const Eigen::Vector3d& from_b = matches.b.point_in_cam[index];
  const Eigen::Vector3d point_in_b = similarity.b_from_a * matches.a.point_in_cam[index];
  const auto in_b = view(point_in_b, matches.b, index);
  const auto in_a = view(similarity.a_from_b * from_b, matches.a, index);
  if (!in_a || !in_b) return std::nullopt;
  const double range_ratio = from_b.norm() * in_b->seen.inverse_range;
  if (!(range_ratio > 0.0 && std::isfinite(range_ratio))) return std::nullopt;
  SimilarityResidual result;
  result.value << in_b->residual, in_a->residual;
  result.jacobian.topRows<2>() = by_perturbation<2>(
      bearing_residual_by_point(in_b->seen, matches.b.level_pixel_from_bearing[index]), point_in_b);
  // (exp(xi) S)^-1 p = S^-1 (exp(-xi) p).
  const Matrix23d by_point_in_b =
      bearing_residual_by_point(in_a->seen, matches.a.level_pixel_from_bearing[index]) *
      similarity.linear_a_from_b;
  result.jacobian.bottomRows<2>() = by_perturbation<2>(-by_point_in_b, from_b);
  if (!is_scale_free) return result;
  result.log_range_ratio = -std::log(range_ratio);
  result.log_range_jacobian =
      by_perturbation<1>(in_b->seen.inverse_range * in_b->seen.direction.transpose(), point_in_b);
  return result;
}

/// Sum of the squared components of SimilarityResidual::value in px^2; kGrossSquaredResidual if
/// there is none. a_from_b is the inverse of b_from_a.
double squared_similarity_residual(const Sim3& b_from_a,
                                   const Sim3& a_from_b,
                                   const LandmarkMatches& matches,
                                   std::size_t index) {
  const auto in_b = view(b_from_a * matches.a.point_in_cam[index], matches.b, index);
  if (!in_b) return kGrossSquaredResidual;
  const auto in_a = view(a_from_b * matches.b.point_in_cam[index], matches.a, index);
  if (!in_a) return kGrossSquaredResidual;
  return in_b->residual.squaredNorm() + in_a->residual.squaredNorm();
}

using Indices = std::span<const std::uint32_t>;

/// Robust value of a squared residual in squared pixels.
struct Loss {
  RobustValue (*function)(double squared_residual, double scale);
  double scale_px;

  RobustValue operator()(double squared_residual) const {
    return function(squared_residual, scale_px);
  }
};

/// The similarity of one set of matches.
class SimilaritySolver {
 public:
  SimilaritySolver(const LandmarkMatches& matches, const SimilarityOptions& options)
      : matches_(matches), options_(options) {}

  NormalEquations<7> linearize(const Sim3& b_from_a, Indices indices, const Loss& loss) const {
    NormalEquations<7> equations;
    const BothWays both_ways(b_from_a);
    for (const std::uint32_t index : indices) {
      const auto residual = residual_of(both_ways, matches_, index, options_.is_scale_free);
      if (!residual) {
        const double num_parts = options_.is_scale_free ? 2.0 : 1.0;
        equations.cost += num_parts * loss(kGrossSquaredResidual).loss;
        continue;
      }
      const RobustValue robust = loss(residual->value.squaredNorm());
      equations.hessian.noalias() +=
          robust.weight * residual->jacobian.transpose() * residual->jacobian;
      equations.gradient.noalias() +=
          robust.weight * residual->jacobian.transpose() * residual->value;
      equations.cost += robust.loss;
      if (options_.is_scale_free) add_range(*residual, loss, equations);
    }
    if (!options_.is_scale_free) {
      equations.hessian.row(6).setZero();
      equations.hessian.col(6).setZero();
      equations.gradient[6] = 0.0;
    }
    return equations;
  }

  void minimize(Sim3& b_from_a, Indices indices, const Loss& loss, int max_iterations) const {
    const auto at = [&](const Sim3& similarity) { return linearize(similarity, indices, loss); };
    const double negligible = kNegligibleSimilarityDecrease * options_.noise_px * options_.noise_px;
    int num_iterations = 0;
    minimize_over_pose(b_from_a, at, max_iterations, negligible, num_iterations);
  }

  /// Runs through Geman-McClure losses from the width of the residuals at hand to that of the
  /// noise.
  void anneal(Sim3& b_from_a, Indices indices) const {
    const double final_scale = kSimilarityFinalScale * options_.noise_px;
    double scale = std::max(final_scale, median_residual(b_from_a, indices));
    for (; scale > final_scale; scale *= kSimilarityAnnealing) {
      minimize(b_from_a, indices, {geman_mcclure, scale}, kSimilarityIterationsPerStage);
    }
    minimize(b_from_a, indices, {geman_mcclure, final_scale}, kSimilarityIterationsPerRound);
  }

  std::vector<std::uint32_t> inliers(const Sim3& b_from_a) const {
    const double gate = options_.gate_chi2 * options_.noise_px * options_.noise_px;
    const Sim3 a_from_b = b_from_a.inverse();
    std::vector<std::uint32_t> result;
    for (std::uint32_t i = 0; i < matches_.size(); ++i) {
      if (squared_similarity_residual(b_from_a, a_from_b, matches_, i) < gate) result.push_back(i);
    }
    return result;
  }

  /// Measures the noise of the ratios of ranges and returns it.
  double measure_range_noise(const Sim3& b_from_a, Indices indices) {
    std::vector<double> ratios;
    const BothWays both_ways(b_from_a);
    for (const std::uint32_t index : indices) {
      const auto residual = residual_of(both_ways, matches_, index, true);
      if (residual) ratios.push_back(residual->log_range_ratio);
    }
    if (ratios.empty()) return range_noise_;
    const double middle = median(ratios);
    for (double& ratio : ratios) ratio = std::abs(ratio - middle);
    range_noise_ = std::clamp(kSigmaFromMedian * median(ratios), kMinRangeNoise, kMaxRangeNoise);
    return range_noise_;
  }

 private:
  /// In units of the bearings' noise, and under the same loss.
  void add_range(const SimilarityResidual& residual,
                 const Loss& loss,
                 NormalEquations<7>& equations) const {
    const double factor = options_.noise_px / range_noise_;
    const double value = factor * residual.log_range_ratio;
    const Vector7d by_similarity = factor * residual.log_range_jacobian.transpose();
    const RobustValue robust = loss(value * value);
    equations.hessian.noalias() += robust.weight * by_similarity * by_similarity.transpose();
    equations.gradient.noalias() += robust.weight * value * by_similarity;
    equations.cost += robust.loss;
  }

  double median_residual(const Sim3& b_from_a, Indices indices) const {
    const Sim3 a_from_b = b_from_a.inverse();
    std::vector<double> values;
    for (const std::uint32_t index : indices) {
      values.push_back(squared_similarity_residual(b_from_a, a_from_b, matches_, index));
    }
    return std::sqrt(median(values));
  }

  const LandmarkMatches& matches_;
  const SimilarityOptions& options_;
  double range_noise_ = kAssumedRangeNoise;
};

/// For ransac(). Errors are in units of the squared noise.
class SimilarityEstimator {
 public:
  /// With the inverse, which every error takes.
  struct Model {
    Sim3 b_from_a, a_from_b;
  };
  static constexpr std::size_t kSampleSize = 3;
  static constexpr double kMaxSquaredError = 9.488;

  SimilarityEstimator(const LandmarkMatches& matches, const SimilarityOptions& options)
      : matches_(matches), options_(options) {}

  std::size_t num_data() const { return matches_.size(); }

  std::vector<Model> fit(std::span<const std::uint32_t, kSampleSize> sample) const {
    std::array<Eigen::Vector3d, kSampleSize> points_a, points_b;
    for (std::size_t i = 0; i < kSampleSize; ++i) {
      points_a[i] = matches_.a.point_in_cam[sample[i]];
      points_b[i] = matches_.b.point_in_cam[sample[i]];
    }
    if (options_.is_scale_free) {
      const auto similarity = align_similarity(points_a, points_b);
      if (similarity) return {model_of(*similarity)};
    } else {
      const auto rigid = align_rigid(points_a, points_b);
      if (rigid) return {model_of(Sim3(*rigid))};
    }
    return {};
  }

  double squared_error(const Model& model, std::size_t index) const {
    return squared_similarity_residual(model.b_from_a, model.a_from_b, matches_, index) /
           (options_.noise_px * options_.noise_px);
  }

  std::optional<Model> refine(const Model& model, Indices nearby) const {
    constexpr int kMaxIterations = 3;
    if (nearby.size() <= kSampleSize) return std::nullopt;
    Sim3 b_from_a = model.b_from_a;
    const Loss loss = {geman_mcclure, kSimilarityFinalScale * options_.noise_px};
    SimilaritySolver(matches_, options_).minimize(b_from_a, nearby, loss, kMaxIterations);
    return model_of(b_from_a);
  }

 private:
  static Model model_of(const Sim3& b_from_a) { return {b_from_a, b_from_a.inverse()}; }

  const LandmarkMatches& matches_;
  const SimilarityOptions& options_;
};

}  // namespace

std::optional<SimilarityResidual> similarity_residual(const Sim3& b_from_a,
                                                      const LandmarkMatches& matches,
                                                      std::size_t index) {
  return residual_of(BothWays(b_from_a), matches, index, true);
}

std::optional<SimilarityEstimate> find_similarity(const LandmarkMatches& matches,
                                                  const SimilarityOptions& options,
                                                  const RansacOptions& ransac_options) {
  const auto consensus = ransac(SimilarityEstimator(matches, options), ransac_options);
  if (!consensus) return std::nullopt;
  return refine_similarity(matches, consensus->model.b_from_a, options);
}

SimilarityEstimate refine_similarity(const LandmarkMatches& matches,
                                     const Sim3& initial_b_from_a,
                                     const SimilarityOptions& options) {
  SimilaritySolver solver(matches, options);
  const Loss huber_loss = {huber, kSimilarityHuberScale * options.noise_px};
  SimilarityEstimate estimate;
  estimate.b_from_a = initial_b_from_a;
  std::vector<std::uint32_t> indices(matches.size());
  std::iota(indices.begin(), indices.end(), 0u);
  if (indices.size() >= kMinMatches) solver.anneal(estimate.b_from_a, indices);
  indices = solver.inliers(estimate.b_from_a);
  for (int round = 0; round < kNumSimilarityRounds && indices.size() >= kMinMatches; ++round) {
    if (options.is_scale_free) {
      estimate.range_noise = solver.measure_range_noise(estimate.b_from_a, indices);
    }
    solver.minimize(estimate.b_from_a, indices, huber_loss, kSimilarityIterationsPerRound);
    auto next = solver.inliers(estimate.b_from_a);
    const bool is_settled = next == indices;
    indices = std::move(next);
    if (is_settled) break;
  }
  estimate.is_inlier.assign(matches.size(), 0);
  for (const std::uint32_t index : indices) estimate.is_inlier[index] = 1;
  estimate.num_inliers = indices.size();
  const NormalEquations<7> last = solver.linearize(estimate.b_from_a, indices, huber_loss);
  estimate.covariance = covariance_from<7>(last.hessian / (options.noise_px * options.noise_px));
  if (!options.is_scale_free) estimate.covariance(6, 6) = 0.0;
  return estimate;
}

}  // namespace waymark

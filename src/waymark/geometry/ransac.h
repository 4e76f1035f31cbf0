// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {

/// What ransac() needs to know of a problem:
///
///   struct LineEstimator {
///     using Model = Line;
///     static constexpr std::size_t kSampleSize = 2;
///     /// A datum with a squared error (in squared standard deviations) above this is an outlier;
///     /// the 95 % quantile of chi-squared suits.
///     static constexpr double kMaxSquaredError = 3.84;
///
///     std::size_t num_data() const;
///     /// All models through a minimal sample of distinct data; may be none.
///     std::vector<Line> fit(std::span<const std::uint32_t, kSampleSize> sample) const;
///     double squared_error(const Line& model, std::size_t index) const;
///     /// A better model from the data near the given one, of which some are outliers: those
///     /// within kNearness times the deviation at which an inlier ends. Nothing if there is none.
///     std::optional<Line> refine(const Line& model, std::span<const std::uint32_t> nearby) const;
///   };
template <class Estimator>
concept RansacEstimator = requires(const Estimator& estimator,
                                   const typename Estimator::Model& model,
                                   std::span<const std::uint32_t, Estimator::kSampleSize> sample,
                                   std::span<const std::uint32_t> nearby,
                                   std::size_t index) {
  { Estimator::kMaxSquaredError } -> std::convertible_to<double>;
  { estimator.num_data() } -> std::convertible_to<std::size_t>;
  { estimator.fit(sample) } -> std::convertible_to<std::vector<typename Estimator::Model>>;
  { estimator.squared_error(model, index) } -> std::convertible_to<double>;
  {
    estimator.refine(model, nearby)
    } -> std::convertible_to<std::optional<typename Estimator::Model>>;
};

struct RansacOptions {
  std::uint64_t seed = 0;
  std::uint64_t stream = 0;   ///< For example the frame: same seed and stream, same result.
  double confidence = 0.999;  ///< Of having drawn one sample without outliers.
  /// Models with a smaller share of inliers need not be found: this limits the iterations.
  double min_inlier_ratio = 0.4;
};

template <class Model>
struct RansacResult {
  Model model;
  std::vector<std::uint32_t> inliers;  ///< Indices in ascending order.
  double cost = 0.0;                   ///< Sum of squared errors, each truncated.
  int num_iterations = 0;
};

namespace ransac_internal {

/// Cost of a model by MSAC (Torr & Zisserman 2000), given up once it exceeds a bound.
template <RansacEstimator Estimator>
double cost(const Estimator& estimator, const typename Estimator::Model& model, double bound) {
  double sum = 0.0;
  const std::size_t num_data = estimator.num_data();
  for (std::size_t i = 0; i < num_data && sum < bound; ++i) {
    const double squared_error = estimator.squared_error(model, i);
    // In this order, so that an error which is not a number is an outlier.
    sum +=
        squared_error < Estimator::kMaxSquaredError ? squared_error : Estimator::kMaxSquaredError;
  }
  return sum;
}

/// Indices of the data whose squared error is below a limit.
template <RansacEstimator Estimator>
std::vector<std::uint32_t> data_within(const Estimator& estimator,
                                       const typename Estimator::Model& model,
                                       double max_squared_error) {
  std::vector<std::uint32_t> indices;
  const std::size_t num_data = estimator.num_data();
  for (std::size_t i = 0; i < num_data; ++i) {
    if (estimator.squared_error(model, i) < max_squared_error) {
      indices.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return indices;
}

template <std::size_t kSize>
std::array<std::uint32_t, kSize> draw_distinct(Rng& rng, std::size_t num_data) {
  std::array<std::uint32_t, kSize> sample;
  for (std::size_t i = 0; i < kSize;) {
    sample[i] = rng.below(static_cast<std::uint32_t>(num_data));
    if (std::find(sample.begin(), sample.begin() + i, sample[i]) == sample.begin() + i) ++i;
  }
  return sample;
}

/// Samples needed to draw one without outliers (Fischler & Bolles 1981).
inline int samples_needed(double inlier_ratio, std::size_t sample_size, double confidence) {
  const double good = std::pow(inlier_ratio, static_cast<double>(sample_size));
  if (good >= 1.0) return 1;
  return static_cast<int>(std::ceil(std::log(1.0 - confidence) / std::log1p(-good)));
}

/// How far beyond the inliers local optimisation looks. A model through a minimal sample is off by
/// several standard deviations, so its own inliers would hold it where it is.
inline constexpr double kNearness = 4.0;
/// Local optimisation of a sample's model starts if it has this share of the support of the best
/// sample's. Were it to be compared with the best optimised model, none but the first few would
/// ever start, and the first local optimum would be the result.
inline constexpr double kPromisingSupport = 0.8;

template <class Model>
struct Scored {
  Model model;
  double cost;
};

/// Refits to the data near the model as long as that lowers the cost (Chum et al. 2003).
template <RansacEstimator Estimator>
Scored<typename Estimator::Model> optimise_locally(const Estimator& estimator,
                                                   Scored<typename Estimator::Model> scored) {
  constexpr int kMaxRounds = 3;
  constexpr double kMaxSquaredError = kNearness * kNearness * Estimator::kMaxSquaredError;
  for (int round = 0; round < kMaxRounds; ++round) {
    const auto nearby = data_within(estimator, scored.model, kMaxSquaredError);
    const auto refined = estimator.refine(scored.model, nearby);
    if (!refined) break;
    const double refined_cost = cost(estimator, *refined, scored.cost);
    if (!(refined_cost < scored.cost)) break;
    const bool is_converged = refined_cost > 0.99 * scored.cost;
    scored = {*refined, refined_cost};
    if (is_converged) break;
  }
  return scored;
}

}  // namespace ransac_internal

/// Locally optimised RANSAC (Chum, Matas & Kittler 2003) with the MSAC cost and adaptive stopping.
/// Nothing if there are fewer data than a sample takes, or if no model has more inliers than that.
template <RansacEstimator Estimator>
std::optional<RansacResult<typename Estimator::Model>> ransac(const Estimator& estimator,
                                                              const RansacOptions& options) {
  namespace internal = ransac_internal;
  using Scored = internal::Scored<typename Estimator::Model>;
  const std::size_t num_data = estimator.num_data();
  if (num_data < Estimator::kSampleSize) return std::nullopt;
  const auto needed_for = [&](double inlier_ratio) {
    const double ratio = std::max(inlier_ratio, options.min_inlier_ratio);
    return internal::samples_needed(ratio, Estimator::kSampleSize, options.confidence);
  };
  const double worst_cost = static_cast<double>(num_data) * Estimator::kMaxSquaredError;
  Rng rng(options.seed, options.stream);
  std::optional<RansacResult<typename Estimator::Model>> best;
  double best_sample_cost = worst_cost;
  int needed = needed_for(0.0);
  int iteration = 0;
  for (; iteration < needed; ++iteration) {
    const auto sample = internal::draw_distinct<Estimator::kSampleSize>(rng, num_data);
    const double bound = worst_cost - internal::kPromisingSupport * (worst_cost - best_sample_cost);
    std::optional<Scored> promising;
    for (const auto& model : estimator.fit(sample)) {
      const double limit = promising ? promising->cost : bound;
      const double cost = internal::cost(estimator, model, limit);
      if (cost < limit) promising = Scored{model, cost};
    }
    if (!promising) continue;
    best_sample_cost = std::min(best_sample_cost, promising->cost);
    const Scored optimised = internal::optimise_locally(estimator, *promising);
    if (best && !(optimised.cost < best->cost)) continue;
    best = {optimised.model,
            internal::data_within(estimator, optimised.model, Estimator::kMaxSquaredError),
            optimised.cost,
            0};
    needed = needed_for(static_cast<double>(best->inliers.size()) / static_cast<double>(num_data));
  }
  if (!best || best->inliers.size() <= Estimator::kSampleSize) return std::nullopt;
  best->num_iterations = iteration;
  return best;
}

}  // namespace waymark

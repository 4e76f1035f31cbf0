// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/weak_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace waymark {
namespace {

/// Points of a grid, which reaches as many standard deviations to either side of the mean.
constexpr int kGridPoints = 13;
constexpr double kGridSigmas = 3.0;
/// A posterior narrower than so many steps is integrated on a finer grid.
constexpr double kFewSteps = 1.0;
/// A scale is held by a belief of this standard deviation in its logarithm.
constexpr double kHeldSigma = 1e-4;

struct ScalePosterior {
  double mean = 0.0;
  double sigma = 0.0;
};

/// Coordinates of places that the samples predict: all but those that tell first place and velocity
/// of each row of poses without missing samples, and the mean acceleration, next to gravity.
double num_predicted(const PreintegrationChain& chain) {
  double count = -3.0;
  for (std::size_t i = 1; i < chain.size(); ++i) count += chain[i] && chain[i - 1] ? 3.0 : 0.0;
  return std::max(count, 0.0);
}

/// Refines at a scale, and leaves the unknowns there.
InertialRefinement refine_at(std::span<const VisionPose> poses,
                             const PreintegrationChain& chain,
                             double log_scale,
                             InertialUnknowns& unknowns,
                             InertialBelief belief,
                             const InertialStartOptions& options) {
  const double growth = std::exp(log_scale - unknowns.setup.log_scale);
  for (InertialState& state : unknowns.states) state.velocity *= growth;
  unknowns.setup.log_scale = belief.log_scale = log_scale;
  belief.log_scale_sigma = kHeldSigma;
  InertialRefinement refined = refine_inertial_start(poses, chain, unknowns, belief, options);
  unknowns = refined.unknowns;
  return refined;
}

ScalePosterior integrate(std::span<const double> log_scales, std::span<const double> logs) {
  const double highest = *std::ranges::max_element(logs);
  double sum = 0.0, mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const double weight = std::exp(logs[i] - highest);
    sum += weight;
    mean += weight * log_scales[i];
    square += weight * log_scales[i] * log_scales[i];
  }
  mean /= sum;
  return {mean, std::sqrt(std::max(square / sum - mean * mean, 0.0))};
}

}  // namespace

InertialRefinement refine_weak_scale(std::span<const VisionPose> poses,
                                     const PreintegrationChain& chain,
                                     InertialUnknowns unknowns,
                                     InertialBelief belief,
                                     const InertialStartOptions& options) {
  ScalePosterior posterior{belief.log_scale, belief.log_scale_sigma};
  const double predicted = num_predicted(chain);
  for (int pass = 0; pass < 2; ++pass) {
    const double step = 2.0 * kGridSigmas * posterior.sigma / (kGridPoints - 1);
    std::vector<double> log_scales, logs;
    for (int i = 0; i < kGridPoints; ++i) {
      const double log_scale = posterior.mean - kGridSigmas * posterior.sigma + i * step;
      const InertialRefinement at = refine_at(poses, chain, log_scale, unknowns, belief, options);
      const double off = (log_scale - belief.log_scale) / belief.log_scale_sigma;
      log_scales.push_back(log_scale);
      // Places are in metres here, not in map units.
      logs.push_back(-0.5 * (at.squared_error + at.log_determinant + off * off) +
                     predicted * log_scale);
    }
    posterior = integrate(log_scales, logs);
    if (posterior.sigma > kFewSteps * step) break;
    posterior.sigma = std::max(posterior.sigma, 0.5 * step);
  }
  InertialRefinement refined = refine_at(poses, chain, posterior.mean, unknowns, belief, options);
  const double held = refined.covariance(2, 2);
  const Eigen::Matrix<double, 25, 1> by_scale = refined.covariance.col(2) / held;
  refined.covariance +=
      (posterior.sigma * posterior.sigma - held) * by_scale * by_scale.transpose();
  return refined;
}

}  // namespace waymark

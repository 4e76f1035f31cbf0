// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/missing_distortion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "waymark/calibrate/lens.h"

namespace waymark {
namespace {

constexpr std::size_t kNumKeyframePairs = 24;
constexpr std::size_t kMaxKeyframesApart = 8;
constexpr std::size_t kMinPairs = 8;
constexpr double kMinCornerShift = 0.03;
/// Of the cost per match, in squared standard deviations: cameras without distortion stay below
/// 0.01, one that moves corners by a tenth is above 0.1.
constexpr double kMinGain = 0.04;
/// In standard deviations of its mean over the pairs.
constexpr double kMinSurety = 4.0;

/// How much better than before a lens explains the matches of a pair, over all pairs.
struct Gain {
  double mean = 0.0;
  double surety = 0.0;  ///< The mean in its own standard deviations.
};

Gain gain_of(const std::vector<double>& before, const std::vector<double>& costs) {
  const double count = static_cast<double>(costs.size());
  if (costs.size() != before.size() || costs.size() < kMinPairs) return {};
  Gain gain;
  double squares = 0.0;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    gain.mean += (before[i] - costs[i]) / count;
    squares += (before[i] - costs[i]) * (before[i] - costs[i]) / count;
  }
  const double variance = std::max(squares - gain.mean * gain.mean, 0.0) / (count - 1.0);
  gain.surety = gain.mean / std::sqrt(std::max(variance, 1e-12));
  return gain;
}

std::vector<double> costs_of(const Camera& camera, std::span<const PixelMatches> pairs) {
  std::vector<double> costs;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    costs.push_back(two_view_cost(camera, pairs.subspan(i, 1)));
  }
  return costs;
}

/// Lenses by the coefficient of the division model times the squared radius of the corners.
class LensCompetition {
 public:
  LensCompetition(std::span<const PixelMatches> pairs, const CameraDescription& ideal)
      : pairs_(pairs),
        ideal_(ideal),
        corner_radius_(std::hypot(0.5 * ideal.width_px / ideal.intrinsics[0],
                                  0.5 * ideal.height_px / ideal.intrinsics[1])) {}

  double division(double strength) const { return strength / (corner_radius_ * corner_radius_); }

  /// Of each pair; empty where there is no such lens.
  std::vector<double> costs(double strength) const {
    CameraDescription lens = ideal_;
    lens.camera_model = lens.distortion_model = "division";
    lens.distortion_coeffs = {division(strength)};
    const auto camera = make_if_possible(lens);
    return camera ? costs_of(*camera, pairs_) : std::vector<double>();
  }

 private:
  std::span<const PixelMatches> pairs_;
  const CameraDescription& ideal_;
  const double corner_radius_;
};

/// By how much the corners move, of half the diagonal.
double corner_shift(double strength) { return std::abs(1.0 / (1.0 + strength) - 1.0); }

}  // namespace

std::vector<PixelMatches> match_keyframes(const Map& map) {
  std::vector<const Features*> features;
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { features.push_back(keyframe.features.get()); });
  const std::size_t num_starts = std::min(kNumKeyframePairs, features.size());
  std::vector<PixelMatches> pairs;
  for (std::size_t i = 0; i < num_starts; ++i) {
    const std::size_t first = i * features.size() / num_starts;
    std::optional<PixelMatches> widest;
    for (std::size_t apart = 1; apart <= kMaxKeyframesApart; apart *= 2) {
      if (first + apart >= features.size()) break;
      auto next = match_pixels(*features[first], *features[first + apart]);
      if (!next) break;
      widest = std::move(next);
    }
    if (widest) pairs.push_back(*std::move(widest));
  }
  return pairs;
}

std::optional<CameraDescription> find_missing_distortion(std::span<const PixelMatches> pairs,
                                                         const CameraDescription& ideal,
                                                         const Camera& in_use) {
  if (pairs.size() < kMinPairs) return std::nullopt;
  const LensCompetition competition(pairs, ideal);
  const std::vector<double> before = costs_of(in_use, pairs);
  double best = 0.0;
  Gain gain;
  const auto compete = [&](double strength) {
    const Gain next = gain_of(before, competition.costs(strength));
    if (next.mean <= gain.mean) return;
    gain = next;
    best = strength;
  };
  // A little of what is missing is better than nothing of it, which spares the rest to most.
  for (const double strength : {-0.06, 0.06}) compete(strength);
  if (gain.surety < 0.5 * kMinSurety) return std::nullopt;
  const double sign = best < 0.0 ? -1.0 : 1.0;
  for (const double strength : {0.03, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4}) compete(sign * strength);
  const double center = best;
  for (const double offset : {-0.025, 0.025}) compete(center + offset);
  if (gain.mean < kMinGain || gain.surety < kMinSurety || corner_shift(best) < kMinCornerShift) {
    return std::nullopt;
  }
  CameraDescription camera = ideal;
  camera.distortion_model = "radtan";
  camera.distortion_coeffs =
      with_coefficients(
          LensModel::kPerspective, ideal.intrinsics[0], competition.division(best), ideal)
          .distortion_coeffs;
  return camera;
}

}  // namespace waymark

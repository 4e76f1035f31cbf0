// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/effects.h"

#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

/// Zero mean, unit variance, from two draws of 64 bits: eight numbers of 16 bits.
double fast_normal(Rng& rng) {
  double sum = 0.0;
  for (int draw = 0; draw < 2; ++draw) {
    const std::uint64_t bits = rng.next();
    sum += static_cast<double>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) +
                               (bits >> 48));
  }
  constexpr double kMean = 8.0 * 65535.0 / 2.0;
  // The variance of a uniform number of n values is (n^2 - 1) / 12.
  static const double kScale = 1.0 / std::sqrt(8.0 * (65536.0 * 65536.0 - 1.0) / 12.0);
  return (sum - kMean) * kScale;
}

}  // namespace

void apply_exposure(const ImageEffects& effects, Rng& rng, Image& image) {
  if (effects.gain == 1.0 && effects.noise_sigma <= 0.0) return;
  for (std::uint8_t& value : image.values) {
    double grey = effects.gain * value;
    if (effects.noise_sigma > 0.0) grey += effects.noise_sigma * fast_normal(rng);
    value = static_cast<std::uint8_t>(std::clamp(grey + 0.5, 0.0, 255.0));
  }
}

void apply_depth_noise(const ImageEffects& effects,
                       double units_per_metre,
                       Rng& rng,
                       DepthImage& depth) {
  if (effects.inverse_depth_sigma <= 0.0) return;
  for (std::uint16_t& value : depth.values) {
    if (value == 0) continue;
    const double inverse = units_per_metre / value + effects.inverse_depth_sigma * fast_normal(rng);
    const double units = std::round(units_per_metre / inverse);
    value = units > 0.0 && units <= 65535.0 ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
  }
}

}  // namespace waymark

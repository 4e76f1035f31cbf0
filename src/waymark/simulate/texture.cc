// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Places read along a long footprint at most; longer ones get blurred.
constexpr int kMaxProbes = 6;

Image half(const Image& image) {
  Image result((image.width_px + 1) / 2, (image.height_px + 1) / 2);
  for (int y = 0; y < result.height_px; ++y) {
    const std::uint8_t* top = image.row(2 * y);
    const std::uint8_t* bottom = image.row(std::min(2 * y + 1, image.height_px - 1));
    std::uint8_t* out = result.row(y);
    for (int x = 0; x < result.width_px; ++x) {
      const int right = std::min(2 * x + 1, image.width_px - 1);
      // Rounding alternates, so that coarse levels neither darken nor brighten.
      const int sum = top[2 * x] + top[right] + bottom[2 * x] + bottom[right];
      out[x] = static_cast<std::uint8_t>((sum + 1 + ((x + y) & 1)) / 4);
    }
  }
  return result;
}

}  // namespace

Texture::Texture(Image base, double texel_m, bool wraps_u)
    : texel_m_(texel_m), texels_per_metre_(static_cast<float>(1.0 / texel_m)), wraps_u_(wraps_u) {
  WAYMARK_CHECK(base.width_px > 0 && base.height_px > 0 && texel_m > 0.0);
  levels_.push_back(std::move(base));
  while (levels_.back().width_px > 1 || levels_.back().height_px > 1) {
    levels_.push_back(half(levels_.back()));
  }
}

float Texture::sample(const Eigen::Vector2f& centre_m,
                      const Eigen::Vector2f& edge_a_m,
                      const Eigen::Vector2f& edge_b_m) const {
  Eigen::Vector2f longer = edge_a_m * texels_per_metre_;
  const Eigen::Vector2f other = edge_b_m * texels_per_metre_;
  const float area = std::abs(longer.x() * other.y() - longer.y() * other.x());
  if (other.squaredNorm() > longer.squaredNorm()) longer = other;
  const float length = longer.norm();
  const float height = std::max({area / std::max(length, 1e-6f), length / kMaxProbes, 1.0f});
  const int num_probes =
      std::clamp(static_cast<int>(std::ceil(length / height - 0.25f)), 1, kMaxProbes);

  const int last = static_cast<int>(levels_.size()) - 1;
  const float lod = std::min(std::log2(height), static_cast<float>(last));
  const int level = std::min(static_cast<int>(lod), std::max(last - 1, 0));
  const float fraction = last == 0 ? 0.0f : lod - static_cast<float>(level);

  Probes probes;
  probes.count = num_probes;
  probes.step = longer / static_cast<float>(num_probes);
  probes.first =
      centre_m * texels_per_metre_ - probes.step * (0.5f * static_cast<float>(num_probes - 1));
  const float fine = wraps_u_ ? mean<true>(level, probes) : mean<false>(level, probes);
  if (fraction <= 0.0f) return fine;
  const float coarse = wraps_u_ ? mean<true>(level + 1, probes) : mean<false>(level + 1, probes);
  return fine + fraction * (coarse - fine);
}

template <bool kWraps>
float Texture::mean(int level, const Probes& probes) const {
  const Image& image = levels_[static_cast<std::size_t>(level)];
  const float scale = 1.0f / static_cast<float>(1 << level);
  const float width = static_cast<float>(image.width_px);
  const float last_column = width - 1.0f;
  const float last_row = static_cast<float>(image.height_px - 1);
  const Eigen::Vector2f step = probes.step * scale;
  float x = probes.first.x() * scale - 0.5f;
  float y = probes.first.y() * scale - 0.5f;
  float sum = 0.0f;
  for (int k = 0; k < probes.count; ++k, x += step.x(), y += step.y()) {
    float column = x;
    if constexpr (kWraps) column = std::max(0.0f, column - width * std::floor(column / width));
    if constexpr (!kWraps) column = std::min(std::max(column, 0.0f), last_column);
    const float row = std::min(std::max(y, 0.0f), last_row);
    const int x0 = std::min(static_cast<int>(column), image.width_px - 1);
    const int y0 = static_cast<int>(row);
    const int is_inside = column < last_column ? 1 : 0;
    const int x1 = kWraps && is_inside == 0 ? 0 : x0 + is_inside;
    const float right = column - static_cast<float>(x0);
    const std::uint8_t* top = image.row(y0);
    const std::uint8_t* bottom = top + (row < last_row ? image.width_px : 0);
    const float upper = top[x0] + right * static_cast<float>(top[x1] - top[x0]);
    const float lower = bottom[x0] + right * static_cast<float>(bottom[x1] - bottom[x0]);
    sum += upper + (row - static_cast<float>(y0)) * (lower - upper);
  }
  return sum / static_cast<float>(probes.count);
}

}  // namespace waymark

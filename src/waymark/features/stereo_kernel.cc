// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo_kernel.h"

#include <cmath>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/stereo_kernel.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_STEREO_KERNEL_ONCE
#define WAYMARK_IMAGE_STEREO_KERNEL_ONCE
namespace waymark {
namespace {

/// Integer sums over a patch; all that a correlation needs.
struct PatchSums {
  std::int32_t v = 0;
  std::int32_t v_v = 0;
  std::int32_t v_t = 0;
};

/// Products of up to 64 * 64 * 255^2 stay below 2^31.
inline std::int32_t scaled_covariance(std::int32_t a_b, std::int32_t a, std::int32_t b) {
  return kSearchArea * a_b - a * b;
}

inline float correlation(const PatchSums& sums, std::int32_t t, std::int32_t t_variance) {
  const std::int32_t v_variance = scaled_covariance(sums.v_v, sums.v, sums.v);
  if (v_variance == 0 || t_variance == 0) return 0.0f;
  const float product = static_cast<float>(v_variance) * static_cast<float>(t_variance);
  return static_cast<float>(scaled_covariance(sums.v_t, sums.v, t)) / std::sqrt(product);
}

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void correlate_all(const SearchPatch& patch,
                   ImageView image,
                   std::span<const PatchCorner> corners,
                   std::span<float> correlations) {
  correlate_reference(patch, image, corners, correlations);
}

AlignSums sum(const AlignPatch& patch, ImageView image, PatchCorner corner, float x, float y) {
  return sum_patch_reference(patch, image, corner, x, y);
}

#else

HWY_INLINE PatchSums sum_pixels(const SearchPatch& patch, ImageView image, PatchCorner corner) {
  const hn::FixedTag<std::int16_t, 8> d16;
  const hn::FixedTag<std::int32_t, 4> d32;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const auto ones = hn::Set(d16, 1);
  auto v = hn::Zero(d32), v_v = hn::Zero(d32), v_t = hn::Zero(d32);
  // Where the sum of a product is spread over two accumulators, this is the second one.
  auto v_more = hn::Zero(d32), v_v_more = hn::Zero(d32), v_t_more = hn::Zero(d32);
  for (int y = 0; y < kSearchSize; ++y) {
    const auto pixels = hn::PromoteTo(d16, hn::LoadU(d8, image.row(corner.y + y) + corner.x));
    const auto t = hn::LoadU(d16, patch.data() + y * kSearchSize);
    v = hn::ReorderWidenMulAccumulate(d32, pixels, ones, v, v_more);
    v_v = hn::ReorderWidenMulAccumulate(d32, pixels, pixels, v_v, v_v_more);
    v_t = hn::ReorderWidenMulAccumulate(d32, pixels, t, v_t, v_t_more);
  }
  return {hn::GetLane(hn::SumOfLanes(d32, hn::Add(v, v_more))),
          hn::GetLane(hn::SumOfLanes(d32, hn::Add(v_v, v_v_more))),
          hn::GetLane(hn::SumOfLanes(d32, hn::Add(v_t, v_t_more)))};
}

void correlate_all(const SearchPatch& patch,
                   ImageView image,
                   std::span<const PatchCorner> corners,
                   std::span<float> correlations) {
  std::int32_t t = 0;
  std::int32_t t_t = 0;
  for (const std::int16_t value : patch) {
    t += value;
    t_t += value * value;
  }
  const std::int32_t t_variance = scaled_covariance(t_t, t, t);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    correlations[i] = correlation(sum_pixels(patch, image, corners[i]), t, t_variance);
  }
}

using FloatTag = hn::FixedTag<float, 4>;
using Floats = hn::Vec<FloatTag>;
constexpr int kVectorsPerRow = kAlignSize / 4;

HWY_INLINE Floats load_pixels(const std::uint8_t* pixels) {
  const FloatTag d;
  const hn::Rebind<std::int32_t, FloatTag> d32;
  const hn::Rebind<std::uint8_t, FloatTag> d8;
  return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, pixels)));
}

/// No fused multiply-add, so that every processor gives the same bits.
HWY_INLINE Floats blend(Floats a, Floats b, Floats weight) {
  return hn::Add(a, hn::Mul(hn::Sub(b, a), weight));
}

HWY_INLINE void blend_row(const std::uint8_t* row,
                          Floats weight,
                          Floats (&result)[kVectorsPerRow]) {
  for (int k = 0; k < kVectorsPerRow; ++k) {
    result[k] = blend(load_pixels(row + 4 * k), load_pixels(row + 4 * k + 1), weight);
  }
}

HWY_INLINE float sum_of_lanes(Floats lanes) {
  alignas(16) float values[4];
  hn::Store(lanes, FloatTag(), values);
  return (values[0] + values[1]) + (values[2] + values[3]);
}

AlignSums sum(const AlignPatch& patch,
              ImageView image,
              PatchCorner corner,
              float fraction_x,
              float fraction_y) {
  const FloatTag d;
  const Floats weight_x = hn::Set(d, fraction_x);
  const Floats weight_y = hn::Set(d, fraction_y);
  Floats v = hn::Zero(d), v_v = v, v_value = v, v_along = v, v_across = v;
  Floats above[kVectorsPerRow];
  Floats below[kVectorsPerRow];
  blend_row(image.row(corner.y) + corner.x, weight_x, above);
  for (int y = 0; y < kAlignSize; ++y) {
    blend_row(image.row(corner.y + y + 1) + corner.x, weight_x, below);
    for (int k = 0; k < kVectorsPerRow; ++k) {
      const int at = y * kAlignSize + 4 * k;
      const Floats pixels = blend(above[k], below[k], weight_y);
      v = hn::Add(v, pixels);
      v_v = hn::Add(v_v, hn::Mul(pixels, pixels));
      v_value = hn::Add(v_value, hn::Mul(pixels, hn::Load(d, patch.value.data() + at)));
      v_along = hn::Add(v_along, hn::Mul(pixels, hn::Load(d, patch.along.data() + at)));
      v_across = hn::Add(v_across, hn::Mul(pixels, hn::Load(d, patch.across.data() + at)));
      above[k] = below[k];
    }
  }
  return {sum_of_lanes(v),
          sum_of_lanes(v_v),
          sum_of_lanes(v_value),
          sum_of_lanes(v_along),
          sum_of_lanes(v_across)};
}

#endif

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(correlate_all);
HWY_EXPORT(sum);

void correlate(const SearchPatch& patch,
               ImageView image,
               std::span<const PatchCorner> corners,
               std::span<float> correlations) {
  WAYMARK_CHECK(correlations.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(correlate_all)(patch, image, corners, correlations);
}

AlignSums sum_patch(const AlignPatch& patch,
                    ImageView image,
                    PatchCorner corner,
                    float fraction_x,
                    float fraction_y) {
  return HWY_DYNAMIC_DISPATCH(sum)(patch, image, corner, fraction_x, fraction_y);
}

void correlate_reference(const SearchPatch& patch,
                         ImageView image,
                         std::span<const PatchCorner> corners,
                         std::span<float> correlations) {
  std::int32_t t = 0;
  std::int32_t t_t = 0;
  for (const std::int16_t value : patch) {
    t += value;
    t_t += value * value;
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    PatchSums sums;
    for (int k = 0; k < kSearchArea; ++k) {
      const std::int32_t v =
          image.at(corners[i].x + k % kSearchSize, corners[i].y + k / kSearchSize);
      sums.v += v;
      sums.v_v += v * v;
      sums.v_t += v * patch[static_cast<std::size_t>(k)];
    }
    correlations[i] = correlation(sums, t, scaled_covariance(t_t, t, t));
  }
}

AlignSums sum_patch_reference(const AlignPatch& patch,
                              ImageView image,
                              PatchCorner corner,
                              float fraction_x,
                              float fraction_y) {
  const auto blend = [](float a, float b, float weight) { return a + (b - a) * weight; };
  std::array<AlignSums, 4> partial{};
  for (int y = 0; y < kAlignSize; ++y) {
    const std::uint8_t* above = image.row(corner.y + y) + corner.x;
    const std::uint8_t* below = above + image.stride;
    for (int x = 0; x < kAlignSize; ++x) {
      const auto at = static_cast<std::size_t>(y * kAlignSize + x);
      const float pixel = blend(blend(above[x], above[x + 1], fraction_x),
                                blend(below[x], below[x + 1], fraction_x),
                                fraction_y);
      AlignSums& sums = partial[static_cast<std::size_t>(x % 4)];
      sums.v += pixel;
      sums.v_v += pixel * pixel;
      sums.v_value += pixel * patch.value[at];
      sums.v_along += pixel * patch.along[at];
      sums.v_across += pixel * patch.across[at];
    }
  }
  const auto total = [&](float AlignSums::*field) {
    return (partial[0].*field + partial[1].*field) + (partial[2].*field + partial[3].*field);
  };
  return {total(&AlignSums::v),
          total(&AlignSums::v_v),
          total(&AlignSums::v_value),
          total(&AlignSums::v_along),
          total(&AlignSums::v_across)};
}

}  // namespace waymark
#endif

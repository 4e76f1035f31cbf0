// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/pyramid.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/pyramid.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_PYRAMID_ONCE
#define WAYMARK_IMAGE_PYRAMID_ONCE
namespace waymark {
namespace {

// Weight of the second of two neighbours, 15 fractional bits; phase 5 has no result.
inline constexpr std::array<std::int16_t, 6> kWeights{3277, 9830, 16384, 22938, 29491, 0};

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
HWY_INLINE V interpolate(V a, V b, V weight) {
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), weight));
}

void interpolate_rows(const std::uint8_t* HWY_RESTRICT above,
                      const std::uint8_t* HWY_RESTRICT below,
                      std::int16_t weight,
                      int width,
                      std::int16_t* HWY_RESTRICT row) {
  const hn::CappedTag<std::int16_t, PaddedImage::kPadding / 2> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const auto w = hn::Set(d16, weight);
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d16))) {
    const auto a = hn::ShiftLeft<7>(hn::PromoteTo(d16, hn::LoadU(d8, above + x)));
    const auto b = hn::ShiftLeft<7>(hn::PromoteTo(d16, hn::LoadU(d8, below + x)));
    hn::StoreU(interpolate(a, b, w), d16, row + x);
  }
}

void interpolate_columns(const std::int16_t* HWY_RESTRICT row,
                         const std::int16_t* HWY_RESTRICT weights,
                         int width,
                         std::uint8_t* HWY_RESTRICT result) {
  const hn::CappedTag<std::int16_t, PaddedImage::kPadding / 2> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const auto half = hn::Set(d16, 64);
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d16))) {
    const auto left = hn::LoadU(d16, row + x);
    const auto right = hn::LoadU(d16, row + x + 1);
    const auto value = interpolate(left, right, hn::LoadU(d16, weights + x));
    hn::StoreU(hn::DemoteTo(d8, hn::ShiftRight<7>(hn::Add(value, half))), d8, result + x);
  }
}

// Leaves out each sixth value.
void close_gaps(const std::uint8_t* HWY_RESTRICT with_gaps,
                int width,
                std::uint8_t* HWY_RESTRICT result) {
#if HWY_TARGET == HWY_SCALAR
  for (int x = 0; x < width; ++x) result[x] = with_gaps[x / 5 * 6 + x % 5];
#else
  const hn::FixedTag<std::uint8_t, 16> d;
  alignas(16) static constexpr std::uint8_t kLanes[16] = {
      0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 11, 11, 11, 11, 11};
  const auto lanes = hn::Load(d, kLanes);
  for (int x = 0; x < width; x += 10) {
    const auto values = hn::LoadU(d, with_gaps + x / 5 * 6);
    hn::StoreU(hn::TableLookupBytes(values, lanes), d, result + x);
  }
#endif
}

void downscale_rows(const PaddedImage& source, DownscaleWorkspace& workspace, PaddedImage& result) {
  const int width = source.width_px();
  for (int y = 0; y < result.height_px(); ++y) {
    const int y0 = y / 5 * 6 + y % 5;
    interpolate_rows(source.row(y0),
                     source.row(y0 + 1),
                     kWeights[static_cast<std::size_t>(y % 5)],
                     width,
                     workspace.row.data());
    interpolate_columns(
        workspace.row.data(), workspace.weights.data(), width, workspace.with_gaps.data());
    close_gaps(workspace.with_gaps.data(), result.width_px(), result.row(y));
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(downscale_rows);

namespace {

// Room for a row and for what the vectors of the last pixels read beyond it.
void reserve(int width, DownscaleWorkspace& workspace) {
  const auto size = static_cast<std::size_t>(width + 2 * PaddedImage::kPadding);
  if (workspace.weights.size() >= size) return;  // The last one for which memory could run out.
  workspace.row.resize(size);
  workspace.with_gaps.resize(size);
  workspace.weights.resize(size);
  for (std::size_t x = 0; x < size; ++x) workspace.weights[x] = kWeights[x % kWeights.size()];
}

}  // namespace

void downscale(const PaddedImage& source, DownscaleWorkspace& workspace, PaddedImage& result) {
  result.resize(source.width_px() * 5 / 6, source.height_px() * 5 / 6);
  reserve(source.width_px(), workspace);
  HWY_DYNAMIC_DISPATCH(downscale_rows)(source, workspace, result);
}

void Pyramid::build(ImageView image) {
  levels_[0].resize(image.width_px, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    std::copy_n(image.row(y), image.width_px, levels_[0].row(y));
  }
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    downscale(levels_[i - 1], workspace_, levels_[i]);
  }
}

}  // namespace waymark
#endif

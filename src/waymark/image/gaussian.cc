// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/gaussian.h"

#include <array>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/image/gaussian.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_GAUSSIAN_ONCE
#define WAYMARK_IMAGE_GAUSSIAN_ONCE
namespace waymark {
namespace {

inline constexpr int kRadius = 3;

// exp(-x^2 / (2 sigma^2)) of distance 0..3, normalised to a sum of 256 over the 7 taps.
inline constexpr std::array<std::uint16_t, kRadius + 1> kTaps{56, 48, 34, 18};

// What the pass along rows adds before it drops 8 fractional bits: a half, and the mean of what
// four truncated products have lost.
inline constexpr std::uint16_t kRounding = 128 + 2;

inline int mirrored(int i, int size) {
  if (i < 0) return -i;
  return i < size ? i : 2 * size - 2 - i;
}

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag16 = hn::CappedTag<std::uint16_t, PaddedImage::kPadding / 2>;
using Rows = std::array<const std::uint8_t*, 2 * kRadius + 1>;

HWY_INLINE hn::Vec<Tag16> load(const std::uint8_t* pixels) {
  const Tag16 d;
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, Tag16>(), pixels));
}

// Exact: 255 * 256 fits into 16 bits.
void blur_columns(const Rows& rows, int width, std::uint16_t* HWY_RESTRICT result) {
  const Tag16 d;
  const auto tap0 = hn::Set(d, kTaps[0]);
  const auto tap1 = hn::Set(d, kTaps[1]);
  const auto tap2 = hn::Set(d, kTaps[2]);
  const auto tap3 = hn::Set(d, kTaps[3]);
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
    auto inner = hn::Mul(load(rows[3] + x), tap0);
    auto outer = hn::Mul(hn::Add(load(rows[2] + x), load(rows[4] + x)), tap1);
    inner = hn::Add(inner, hn::Mul(hn::Add(load(rows[1] + x), load(rows[5] + x)), tap2));
    outer = hn::Add(outer, hn::Mul(hn::Add(load(rows[0] + x), load(rows[6] + x)), tap3));
    hn::StoreU(hn::Add(inner, outer), d, result + x);
  }
}

// row[0] is three pixels left of the first one. A pair of taps is averaged, since its sum would
// need 17 bits; twice the tap makes up for it.
void blur_row(const std::uint16_t* HWY_RESTRICT row, int width, std::uint8_t* HWY_RESTRICT result) {
  const Tag16 d;
  const hn::Rebind<std::uint8_t, Tag16> d8;
  const auto tap0 = hn::Set(d, static_cast<std::uint16_t>(kTaps[0] << 8));
  const auto tap1 = hn::Set(d, static_cast<std::uint16_t>(kTaps[1] << 9));
  const auto tap2 = hn::Set(d, static_cast<std::uint16_t>(kTaps[2] << 9));
  const auto tap3 = hn::Set(d, static_cast<std::uint16_t>(kTaps[3] << 9));
  const auto rounding = hn::Set(d, kRounding);
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
    const auto load = [&](int tap) { return hn::LoadU(d, row + x + tap); };
    auto inner = hn::Add(hn::MulHigh(load(3), tap0), rounding);
    auto outer = hn::MulHigh(hn::AverageRound(load(2), load(4)), tap1);
    inner = hn::Add(inner, hn::MulHigh(hn::AverageRound(load(1), load(5)), tap2));
    outer = hn::Add(outer, hn::MulHigh(hn::AverageRound(load(0), load(6)), tap3));
    const auto sum = hn::ShiftRight<8>(hn::Add(inner, outer));
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(hn::RebindToSigned<Tag16>(), sum)), d8, result + x);
  }
}

void blur(const PaddedImage& source, std::uint16_t* row, PaddedImage& result) {
  const int width = source.width_px();
  const int height = source.height_px();
  std::uint16_t* const first = row + kRadius;
  for (int y = 0; y < height; ++y) {
    Rows rows;
    for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
      rows[static_cast<std::size_t>(i)] = source.row(mirrored(y + i - kRadius, height));
    }
    blur_columns(rows, width, first);
    for (int i = 1; i <= kRadius; ++i) {
      first[-i] = first[i];
      first[width - 1 + i] = first[width - 1 - i];
    }
    blur_row(row, width, result.row(y));
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(blur);

void BlurWorkspace::reserve(int width_px) {
  const auto size = static_cast<std::size_t>(width_px + 2 * PaddedImage::kPadding);
  if (row.size() < size) row.resize(size);
}

void gaussian_blur(const PaddedImage& source, BlurWorkspace& workspace, PaddedImage& result) {
  WAYMARK_CHECK(source.width_px() > kRadius && source.height_px() > kRadius);
  result.resize(source.width_px(), source.height_px());
  workspace.reserve(source.width_px());
  HWY_DYNAMIC_DISPATCH(blur)(source, workspace.row.data(), result);
}

}  // namespace waymark
#endif

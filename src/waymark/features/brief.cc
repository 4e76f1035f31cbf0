// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/brief.h"

#include <array>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/features/brief_pattern.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/brief.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_BRIEF_ONCE
#define WAYMARK_IMAGE_BRIEF_ONCE
namespace waymark {
namespace {

// --- Blur ---

inline constexpr int kBlurRadius = 3;

// exp(-x^2 / (2 sigma^2)) of distance 0..3, normalised to a sum of 256 over the 7 taps.
inline constexpr std::array<std::uint16_t, kBlurRadius + 1> kTaps{56, 48, 34, 18};

// What the pass along rows adds before it drops 8 fractional bits: a half, and the mean of what
// four truncated products have lost.
inline constexpr std::uint16_t kRounding = 128 + 2;

inline int mirrored(int i, int size) {
  if (i < 0) return -i;
  return i < size ? i : 2 * size - 2 - i;
}

// --- Orientation ---

inline constexpr int kDiscColumns = 32;  // 31 of the disc and one of no weight.

// Half the width of the disc at each distance from its middle row: the circle rounded in one octant
// and mirrored in the others. The values are those of OpenCV's orb.cpp, (c) 2009 Willow Garage,
// Inc., BSD-3-Clause as in brief_pattern.h, so that angles agree with those of other ORB features.
inline constexpr std::array<int, kOrientationRadius + 1> kHalfWidths{
    15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};

// Bits of the pixels in the disc, by distance from the middle row and column.
inline constexpr auto kInside = [] {
  std::array<std::array<std::int16_t, kDiscColumns>, kOrientationRadius + 1> inside{};
  for (int v = 0; v <= kOrientationRadius; ++v) {
    const int half_width = kHalfWidths[static_cast<std::size_t>(v)];
    for (int u = -half_width; u <= half_width; ++u) {
      inside[static_cast<std::size_t>(v)][static_cast<std::size_t>(u + kOrientationRadius)] = -1;
    }
  }
  return inside;
}();

inline constexpr auto kColumnOffsets = [] {
  std::array<std::int16_t, kDiscColumns> offsets{};
  for (int i = 0; i < kDiscColumns; ++i) {
    offsets[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(i - kOrientationRadius);
  }
  return offsets;
}();

// --- Descriptors ---

inline constexpr int kTests = static_cast<int>(kBriefPattern.size());
inline constexpr int kPoints = 2 * kTests;

// Coordinates have 10 fractional bits, which leaves room for 13 sqrt(2) in 16 bits; sine and cosine
// have 15.
inline constexpr int kFraction = 10;

struct Pattern {
  std::array<std::int16_t, kPoints> x;
  std::array<std::int16_t, kPoints> y;
};

// The first points of all tests, then the second ones.
inline constexpr Pattern kPattern = [] {
  Pattern pattern{};
  for (std::size_t i = 0; i < kTests; ++i) {
    pattern.x[i] = static_cast<std::int16_t>(kBriefPattern[i].x0 * (1 << kFraction));
    pattern.y[i] = static_cast<std::int16_t>(kBriefPattern[i].y0 * (1 << kFraction));
    pattern.x[i + kTests] = static_cast<std::int16_t>(kBriefPattern[i].x1 * (1 << kFraction));
    pattern.y[i + kTests] = static_cast<std::int16_t>(kBriefPattern[i].y1 * (1 << kFraction));
  }
  return pattern;
}();

struct Rotation {
  std::int16_t cos;
  std::int16_t sin;
};

inline Rotation rotation_by(float angle_rad) {
  return {static_cast<std::int16_t>(std::lround(std::cos(angle_rad) * 32767.0f)),
          static_cast<std::int16_t>(std::lround(std::sin(angle_rad) * 32767.0f))};
}

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// --- Blur ---

using Tag16 = hn::CappedTag<std::uint16_t, PaddedImage::kPadding / 2>;
using Rows = std::array<const std::uint8_t*, 2 * kBlurRadius + 1>;

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
  std::uint16_t* const first = row + kBlurRadius;
  for (int y = 0; y < height; ++y) {
    Rows rows;
    for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
      rows[static_cast<std::size_t>(i)] = source.row(mirrored(y + i - kBlurRadius, height));
    }
    blur_columns(rows, width, first);
    for (int i = 1; i <= kBlurRadius; ++i) {
      first[-i] = first[i];
      first[width - 1 + i] = first[width - 1 - i];
    }
    blur_row(row, width, result.row(y));
  }
}

// --- Orientation ---

struct Moments {
  std::int32_t x = 0;
  std::int32_t y = 0;
};

HWY_INLINE std::int32_t sum_of(hn::Vec<hn::CappedTag<std::int16_t, kDiscColumns>> values) {
  const hn::RepartitionToWide<hn::CappedTag<std::int16_t, kDiscColumns>> d32;
  const auto ones = hn::Set(hn::CappedTag<std::int16_t, kDiscColumns>(), 1);
  auto odd = hn::Zero(d32);
  const auto sums = hn::ReorderWidenMulAccumulate(d32, values, ones, hn::Zero(d32), odd);
  return hn::GetLane(hn::SumOfLanes(d32, hn::Add(sums, odd)));
}

// Sums by column stay within 16 bits: 31 * 255 for the pixels, (1 + ... + 15) * 255 for their
// moments about the middle row.
HWY_INLINE Moments moments(const std::uint8_t* HWY_RESTRICT centre, std::ptrdiff_t stride) {
  const hn::CappedTag<std::int16_t, kDiscColumns> d;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const hn::RepartitionToWide<decltype(d)> d32;
  Moments result;
  for (int i = 0; i < kDiscColumns; i += static_cast<int>(hn::Lanes(d))) {
    const auto load = [&](int v) HWY_ATTR {
      return hn::PromoteTo(d, hn::LoadU(d8, centre + v * stride + i - kOrientationRadius));
    };
    auto sums = hn::And(load(0), hn::LoadU(d, kInside[0].data() + i));
    auto moments_y = hn::Zero(d);
    for (int v = 1; v <= kOrientationRadius; ++v) {
      const auto inside = hn::LoadU(d, kInside[static_cast<std::size_t>(v)].data() + i);
      const auto below = hn::And(load(v), inside);
      const auto above = hn::And(load(-v), inside);
      sums = hn::Add(sums, hn::Add(below, above));
      const auto weight = hn::Set(d, static_cast<std::int16_t>(v));
      moments_y = hn::Add(moments_y, hn::Mul(hn::Sub(below, above), weight));
    }
    auto odd = hn::Zero(d32);
    const auto offsets = hn::LoadU(d, kColumnOffsets.data() + i);
    const auto even = hn::ReorderWidenMulAccumulate(d32, sums, offsets, hn::Zero(d32), odd);
    result.x += hn::GetLane(hn::SumOfLanes(d32, hn::Add(even, odd)));
    result.y += sum_of(moments_y);
  }
  return result;
}

void orient_all(const PaddedImage& image, std::span<const Corner> corners, float* angles_rad) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Moments m = moments(image.row(corners[i].y_px) + corners[i].x_px, image.stride());
    angles_rad[i] = std::atan2(static_cast<float>(m.y), static_cast<float>(m.x));
  }
}

// --- Descriptors ---

// Distance in memory from the centre to each point of the turned pattern.
HWY_INLINE void turn(Rotation rotation, std::int32_t stride, std::int32_t* HWY_RESTRICT offsets) {
  const hn::CappedTag<std::int32_t, 16> d32;
  const hn::Rebind<std::int16_t, decltype(d32)> d16;
  const auto cos = hn::Set(d16, rotation.cos);
  const auto sin = hn::Set(d16, rotation.sin);
  const auto half = hn::Set(d16, 1 << (kFraction - 1));
  const auto pitch = hn::Set(d32, stride);
  for (int i = 0; i < kPoints; i += static_cast<int>(hn::Lanes(d32))) {
    const auto x = hn::LoadU(d16, kPattern.x.data() + i);
    const auto y = hn::LoadU(d16, kPattern.y.data() + i);
    const auto u = hn::Sub(hn::MulFixedPoint15(x, cos), hn::MulFixedPoint15(y, sin));
    const auto v = hn::Add(hn::MulFixedPoint15(x, sin), hn::MulFixedPoint15(y, cos));
    const auto column = hn::PromoteTo(d32, hn::ShiftRight<kFraction>(hn::Add(u, half)));
    const auto row = hn::PromoteTo(d32, hn::ShiftRight<kFraction>(hn::Add(v, half)));
    hn::Store(hn::Add(hn::Mul(row, pitch), column), d32, offsets + i);
  }
}

// From the last test of each word to the first, so that bits get in by doubling; the four words
// side by side, for they do not wait for each other.
HWY_INLINE Descriptor compare(const std::uint8_t* HWY_RESTRICT centre,
                              const std::int32_t* HWY_RESTRICT offsets) {
  Descriptor bits{};
  for (int i = 63; i >= 0; --i) {
    for (int word = 0; word < 4; ++word) {
      const int test = 64 * word + i;
      const std::uint8_t first = centre[offsets[test]];
      const std::uint8_t second = centre[offsets[test + kTests]];
      bits[word] = bits[word] + bits[word] + (first < second ? 1 : 0);
    }
  }
  return bits;
}

void describe_all(const PaddedImage& smooth,
                  std::span<const Corner> corners,
                  const float* angles_rad,
                  Descriptor* descriptors) {
  HWY_ALIGN std::int32_t offsets[kPoints];
  for (std::size_t i = 0; i < corners.size(); ++i) {
    turn(rotation_by(angles_rad[i]), static_cast<std::int32_t>(smooth.stride()), offsets);
    descriptors[i] = compare(smooth.row(corners[i].y_px) + corners[i].x_px, offsets);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(blur);
HWY_EXPORT(orient_all);
HWY_EXPORT(describe_all);

void BlurWorkspace::reserve(int width_px) {
  const auto size = static_cast<std::size_t>(width_px + 2 * PaddedImage::kPadding);
  if (row.size() < size) row.resize(size);
}

void gaussian_blur(const PaddedImage& source, BlurWorkspace& workspace, PaddedImage& result) {
  WAYMARK_CHECK(source.width_px() > kBlurRadius && source.height_px() > kBlurRadius);
  result.resize(source.width_px(), source.height_px());
  workspace.reserve(source.width_px());
  HWY_DYNAMIC_DISPATCH(blur)(source, workspace.row.data(), result);
}

void orient(const PaddedImage& image,
            std::span<const Corner> corners,
            std::span<float> angles_rad) {
  WAYMARK_CHECK(angles_rad.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(orient_all)(image, corners, angles_rad.data());
}

void describe(const PaddedImage& smooth,
              std::span<const Corner> corners,
              std::span<const float> angles_rad,
              std::span<Descriptor> descriptors) {
  WAYMARK_CHECK(angles_rad.size() == corners.size() && descriptors.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(describe_all)(smooth, corners, angles_rad.data(), descriptors.data());
}

}  // namespace waymark
#endif

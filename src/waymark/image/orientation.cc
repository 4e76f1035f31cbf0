// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/orientation.h"

#include <array>
#include <cmath>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/image/orientation.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_ORIENTATION_ONCE
#define WAYMARK_IMAGE_ORIENTATION_ONCE
namespace waymark {
namespace {

inline constexpr int kColumns = 32;  // 31 of the disc and one of no weight.

// Half the width of the disc at each distance from its middle row: the circle rounded in one octant
// and mirrored in the others. The values are those of OpenCV's orb.cpp, (c) 2009 Willow Garage,
// Inc., BSD-3-Clause as in brief_pattern.h, so that angles agree with those of other ORB features.
inline constexpr std::array<int, kOrientationRadius + 1> kHalfWidths{
    15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};

// Bits of the pixels in the disc, by distance from the middle row and column.
inline constexpr auto kInside = [] {
  std::array<std::array<std::int16_t, kColumns>, kOrientationRadius + 1> inside{};
  for (int v = 0; v <= kOrientationRadius; ++v) {
    const int half_width = kHalfWidths[static_cast<std::size_t>(v)];
    for (int u = -half_width; u <= half_width; ++u) {
      inside[static_cast<std::size_t>(v)][static_cast<std::size_t>(u + kOrientationRadius)] = -1;
    }
  }
  return inside;
}();

inline constexpr auto kColumnOffsets = [] {
  std::array<std::int16_t, kColumns> offsets{};
  for (int i = 0; i < kColumns; ++i) {
    offsets[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(i - kOrientationRadius);
  }
  return offsets;
}();

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

struct Moments {
  std::int32_t x = 0;
  std::int32_t y = 0;
};

HWY_INLINE std::int32_t sum_of(hn::Vec<hn::CappedTag<std::int16_t, kColumns>> values) {
  const hn::RepartitionToWide<hn::CappedTag<std::int16_t, kColumns>> d32;
  const auto ones = hn::Set(hn::CappedTag<std::int16_t, kColumns>(), 1);
  auto odd = hn::Zero(d32);
  const auto sums = hn::ReorderWidenMulAccumulate(d32, values, ones, hn::Zero(d32), odd);
  return hn::GetLane(hn::SumOfLanes(d32, hn::Add(sums, odd)));
}

// Sums by column stay within 16 bits: 31 * 255 for the pixels, (1 + ... + 15) * 255 for their
// moments about the middle row.
HWY_INLINE Moments moments(const std::uint8_t* HWY_RESTRICT centre, std::ptrdiff_t stride) {
  const hn::CappedTag<std::int16_t, kColumns> d;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const hn::RepartitionToWide<decltype(d)> d32;
  Moments result;
  for (int i = 0; i < kColumns; i += static_cast<int>(hn::Lanes(d))) {
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

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(orient_all);

void orient(const PaddedImage& image,
            std::span<const Corner> corners,
            std::span<float> angles_rad) {
  WAYMARK_CHECK(angles_rad.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(orient_all)(image, corners, angles_rad.data());
}

}  // namespace waymark
#endif

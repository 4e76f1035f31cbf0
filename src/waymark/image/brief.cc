// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/brief.h"

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/image/brief_pattern.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/image/brief.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_BRIEF_ONCE
#define WAYMARK_IMAGE_BRIEF_ONCE
namespace waymark {
namespace {

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

HWY_EXPORT(describe_all);

void describe(const PaddedImage& smooth,
              std::span<const Corner> corners,
              std::span<const float> angles_rad,
              std::span<Descriptor> descriptors) {
  WAYMARK_CHECK(angles_rad.size() == corners.size() && descriptors.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(describe_all)(smooth, corners, angles_rad.data(), descriptors.data());
}

}  // namespace waymark
#endif

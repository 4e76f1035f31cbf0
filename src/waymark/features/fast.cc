// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/fast.h"

#include <algorithm>
#include <array>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/fast.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_FAST_ONCE
#define WAYMARK_IMAGE_FAST_ONCE
namespace waymark {
namespace {

inline constexpr int kRingSize = 16;

struct RingOffset {
  int x;
  int y;
};
inline constexpr std::array<RingOffset, kRingSize> kRing{{{0, 3},
                                                          {1, 3},
                                                          {2, 2},
                                                          {3, 1},
                                                          {3, 0},
                                                          {3, -1},
                                                          {2, -2},
                                                          {1, -3},
                                                          {0, -3},
                                                          {-1, -3},
                                                          {-2, -2},
                                                          {-3, -1},
                                                          {-3, 0},
                                                          {-3, 1},
                                                          {-2, 2},
                                                          {-1, 3}}};

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

struct Lower {
  template <class V>
  static HWY_INLINE V of(V a, V b) {
    return hn::Min(a, b);
  }
};
struct Higher {
  template <class V>
  static HWY_INLINE V of(V a, V b) {
    return hn::Max(a, b);
  }
};

// For Worst = Lower, Best = Higher: the best over all arcs of 9 of the lowest pixel in the arc.
// Two arcs that share 8 pixels are done at once: they differ by the one at either end.
template <class Worst, class Best, class V>
HWY_INLINE V best_arc(const V (&ring)[kRingSize]) {
  V two[kRingSize / 2];
  for (int i = 0; i < 8; ++i) two[i] = Worst::of(ring[2 * i + 1], ring[(2 * i + 2) % kRingSize]);
  V four[kRingSize / 2];
  for (int i = 0; i < 8; ++i) four[i] = Worst::of(two[i], two[(i + 1) % 8]);
  V best = ring[0];
  for (int i = 0; i < 8; ++i) {
    const V eight = Worst::of(four[i], four[(i + 2) % 8]);
    const V nine = Worst::of(eight, Best::of(ring[2 * i], ring[(2 * i + 9) % kRingSize]));
    best = i == 0 ? nine : Best::of(best, nine);
  }
  return best;
}

template <class V>
HWY_INLINE V brighter_score(const V (&ring)[kRingSize], V centre) {
  return hn::SaturatedSub(best_arc<Lower, Higher>(ring), centre);
}

template <class V>
HWY_INLINE V darker_score(const V (&ring)[kRingSize], V centre) {
  return hn::SaturatedSub(centre, best_arc<Higher, Lower>(ring));
}

template <class V>
HWY_INLINE bool is_any_above(V values, V threshold) {
  return !hn::AllTrue(hn::DFromV<V>(), hn::Eq(hn::Max(values, threshold), threshold));
}

// Any arc of 9 holds two neighbours of the four compass points, which rules out many pixels, for
// one side or both.
HWY_INLINE void score_row(const std::uint8_t* HWY_RESTRICT row,
                          std::ptrdiff_t stride,
                          int width,
                          int min_contrast,
                          std::uint8_t* HWY_RESTRICT scores) {
  const hn::CappedTag<std::uint8_t, PaddedImage::kPadding> d;
  const auto threshold = hn::Set(d, static_cast<std::uint8_t>(min_contrast));
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
    const auto load = [&](int i) HWY_ATTR {
      return hn::LoadU(d, row + x + kRing[i].y * stride + kRing[i].x);
    };
    const auto centre = hn::LoadU(d, row + x);
    const auto north = load(8);
    const auto south = load(0);
    const auto east = load(4);
    const auto west = load(12);
    const auto high = hn::Min(hn::Max(north, south), hn::Max(east, west));
    const auto low = hn::Max(hn::Min(north, south), hn::Min(east, west));
    const bool may_be_brighter = is_any_above(hn::SaturatedSub(high, centre), threshold);
    const bool may_be_darker = is_any_above(hn::SaturatedSub(centre, low), threshold);
    auto score = hn::Zero(d);
    if (may_be_brighter || may_be_darker) {
      hn::Vec<decltype(d)> ring[kRingSize];
      for (int i = 0; i < kRingSize; ++i) ring[i] = load(i);
      if (may_be_brighter) score = brighter_score(ring, centre);
      if (may_be_darker) score = hn::Max(score, darker_score(ring, centre));
      score = hn::IfThenZeroElse(hn::Eq(hn::Max(score, threshold), threshold), score);
    }
    hn::StoreU(score, d, scores + x);
  }
}

void score_window(const PaddedImage& image,
                  const Window& window,
                  int min_contrast,
                  PaddedImage& scores) {
  for (int y = 0; y < window.height_px; ++y) {
    score_row(image.row(window.y_px + y) + window.x_px,
              image.stride(),
              window.width_px,
              min_contrast,
              scores.row(y));
  }
}

void score_patches(const PaddedImage& image,
                   std::span<const Corner> corners,
                   ScorePatch* HWY_RESTRICT patches) {
  const hn::CappedTag<std::uint8_t, 16> d;
  HWY_ALIGN std::uint8_t row_scores[16];
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (int y = 0; y < 3; ++y) {
      const std::uint8_t* const row = image.row(corners[i].y_px + y - 1) + corners[i].x_px - 1;
      for (int x = 0; x < 3; x += lanes) {
        hn::Vec<decltype(d)> ring[kRingSize];
        for (int k = 0; k < kRingSize; ++k) {
          ring[k] = hn::LoadU(d, row + x + kRing[k].y * image.stride() + kRing[k].x);
        }
        const auto centre = hn::LoadU(d, row + x);
        const auto score = hn::Max(brighter_score(ring, centre), darker_score(ring, centre));
        hn::StoreU(score, d, row_scores + x);
      }
      std::copy_n(row_scores, 3, patches[i].data() + 3 * y);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(score_window);
HWY_EXPORT(score_patches);

void fast_scores(const PaddedImage& image,
                 const Window& window,
                 int min_contrast,
                 PaddedImage& scores) {
  WAYMARK_CHECK(min_contrast >= 0 && min_contrast < 255);
  WAYMARK_CHECK(window.x_px >= kFastRadius &&
                window.x_px + window.width_px <= image.width_px() - kFastRadius);
  WAYMARK_CHECK(window.y_px >= kFastRadius &&
                window.y_px + window.height_px <= image.height_px() - kFastRadius);
  scores.resize(window.width_px, window.height_px);
  HWY_DYNAMIC_DISPATCH(score_window)(image, window, min_contrast, scores);
}

void fast_score_patches(const PaddedImage& image,
                        std::span<const Corner> corners,
                        std::span<ScorePatch> patches) {
  WAYMARK_CHECK(patches.size() == corners.size());
  HWY_DYNAMIC_DISPATCH(score_patches)(image, corners, patches.data());
}

SubpixelOffset locate_peak(const ScorePatch& s) {
  const int left = s[0] + s[3] + s[6];
  const int middle = s[1] + s[4] + s[7];
  const int right = s[2] + s[5] + s[8];
  const int top = s[0] + s[1] + s[2];
  const int centre = s[3] + s[4] + s[5];
  const int bottom = s[6] + s[7] + s[8];
  // The normal equations of a regular grid fall apart into sums; all times 12.
  const auto gradient_x = static_cast<float>(2 * (right - left));
  const auto gradient_y = static_cast<float>(2 * (bottom - top));
  const auto curvature_xx = static_cast<float>(4 * (left - 2 * middle + right));
  const auto curvature_yy = static_cast<float>(4 * (top - 2 * centre + bottom));
  const auto curvature_xy = static_cast<float>(3 * (s[0] + s[8] - s[2] - s[6]));
  const float determinant = curvature_xx * curvature_yy - curvature_xy * curvature_xy;
  if (!(determinant > 0.0f) || curvature_xx >= 0.0f) return {};
  const float x = (curvature_xy * gradient_y - curvature_yy * gradient_x) / determinant;
  const float y = (curvature_xy * gradient_x - curvature_xx * gradient_y) / determinant;
  return {std::clamp(x, -0.5f, 0.5f), std::clamp(y, -0.5f, 0.5f)};
}

}  // namespace waymark
#endif

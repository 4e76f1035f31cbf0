// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/fast.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/image/fast.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_FAST_ONCE
#define WAYMARK_IMAGE_FAST_ONCE
namespace waymark {
namespace {

inline constexpr int kRingSize = 16;
inline constexpr int kArc = 9;

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
using Tag = hn::CappedTag<std::uint8_t, PaddedImage::kPadding>;
using Pixels = hn::Vec<Tag>;

struct Lower {
  static HWY_INLINE Pixels of(Pixels a, Pixels b) { return hn::Min(a, b); }
};
struct Higher {
  static HWY_INLINE Pixels of(Pixels a, Pixels b) { return hn::Max(a, b); }
};

// For Worst = Lower, Best = Higher: the best over all arcs of 9 of the lowest pixel in the arc.
// Two arcs that share 8 pixels are done at once: they differ by the one at either end.
template <class Worst, class Best>
HWY_INLINE Pixels best_arc(const Pixels (&ring)[kRingSize]) {
  const auto at = [&](int i) HWY_ATTR { return ring[i % kRingSize]; };
  Pixels two[kRingSize / 2];
  for (int i = 0; i < 8; ++i) two[i] = Worst::of(at(2 * i + 1), at(2 * i + 2));
  Pixels four[kRingSize / 2];
  for (int i = 0; i < 8; ++i) four[i] = Worst::of(two[i], two[(i + 1) % 8]);
  Pixels best = hn::Undefined(Tag());
  for (int i = 0; i < 8; ++i) {
    const Pixels eight = Worst::of(four[i], four[(i + 2) % 8]);
    const Pixels nine = Worst::of(eight, Best::of(at(2 * i), at(2 * i + 9)));
    best = i == 0 ? nine : Best::of(best, nine);
  }
  return best;
}

// Any arc of 9 holds two neighbours of the four compass points, which tells most pixels apart.
HWY_INLINE bool may_hold_corner(
    Pixels centre, Pixels north, Pixels east, Pixels south, Pixels west, Pixels min_contrast) {
  const Pixels high = hn::Min(hn::Max(north, south), hn::Max(east, west));
  const Pixels low = hn::Max(hn::Min(north, south), hn::Min(east, west));
  const Pixels contrast = hn::Max(hn::SaturatedSub(high, centre), hn::SaturatedSub(centre, low));
  return !hn::AllTrue(Tag(), hn::Eq(hn::Max(contrast, min_contrast), min_contrast));
}

void score_row(const std::uint8_t* HWY_RESTRICT row,
               std::ptrdiff_t stride,
               int begin,
               int end,
               int min_contrast,
               std::uint8_t* HWY_RESTRICT scores) {
  const Tag d;
  const Pixels threshold = hn::Set(d, static_cast<std::uint8_t>(min_contrast));
  for (int x = begin; x < end; x += static_cast<int>(hn::Lanes(d))) {
    const auto load = [&](int i) HWY_ATTR {
      return hn::LoadU(d, row + x + kRing[i].y * stride + kRing[i].x);
    };
    const Pixels centre = hn::LoadU(d, row + x);
    if (!may_hold_corner(centre, load(8), load(4), load(0), load(12), threshold)) {
      hn::StoreU(hn::Zero(d), d, scores + x);
      continue;
    }
    Pixels ring[kRingSize];
    for (int i = 0; i < kRingSize; ++i) ring[i] = load(i);
    const Pixels brighter = hn::SaturatedSub(best_arc<Lower, Higher>(ring), centre);
    const Pixels darker = hn::SaturatedSub(centre, best_arc<Higher, Lower>(ring));
    const Pixels score = hn::Max(brighter, darker);
    hn::StoreU(
        hn::IfThenZeroElse(hn::Eq(hn::Max(score, threshold), threshold), score), d, scores + x);
  }
}

void score_rows(const PaddedImage& image, int margin, int min_contrast, PaddedImage& scores) {
  for (int y = margin; y < image.height_px() - margin; ++y) {
    score_row(image.row(y),
              image.stride(),
              margin,
              image.width_px() - margin,
              min_contrast,
              scores.row(y));
  }
}

// One bit for each lane that is a maximum.
HWY_INLINE std::uint64_t maxima(const std::uint8_t* HWY_RESTRICT row,
                                std::ptrdiff_t stride,
                                Pixels min_contrast) {
  const Tag d;
  const auto load = [&](std::ptrdiff_t offset) HWY_ATTR { return hn::LoadU(d, row + offset); };
  const Pixels before =
      hn::Max(hn::Max(load(-stride - 1), load(-stride)), hn::Max(load(-stride + 1), load(-1)));
  const Pixels after =
      hn::Max(hn::Max(load(stride - 1), load(stride)), hn::Max(load(stride + 1), load(1)));
  // At least as large as those before: larger than one less.
  const Pixels below = hn::SaturatedSub(before, hn::Set(d, std::uint8_t{1}));
  const Pixels rest = hn::Max(hn::Max(below, after), min_contrast);
  const auto is_maximum = hn::Ne(hn::Max(load(0), rest), rest);
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, is_maximum, bytes);
  std::uint64_t bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

std::size_t find_maxima(const PaddedImage& scores, int margin, int min_contrast, Corner* corners) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const Pixels threshold = hn::Set(d, static_cast<std::uint8_t>(min_contrast));
  const int end = scores.width_px() - margin - 1;
  Corner* next = corners;
  for (int y = margin + 1; y < scores.height_px() - margin - 1; ++y) {
    const std::uint8_t* const row = scores.row(y);
    for (int x = margin + 1; x < end; x += lanes) {
      std::uint64_t bits = maxima(row + x, scores.stride(), threshold);
      if (end - x < 64) bits &= (std::uint64_t{1} << (end - x)) - 1;
      for (; bits != 0; bits &= bits - 1) {
        const int column = x + std::countr_zero(bits);
        *next++ = {static_cast<std::uint16_t>(column), static_cast<std::uint16_t>(y), row[column]};
      }
    }
  }
  return static_cast<std::size_t>(next - corners);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(score_rows);
HWY_EXPORT(find_maxima);

void fast_scores(const PaddedImage& image, int margin_px, int min_contrast, PaddedImage& scores) {
  WAYMARK_CHECK(margin_px >= kFastRadius && min_contrast >= 0 && min_contrast < 255);
  scores.resize(image.width_px(), image.height_px());
  HWY_DYNAMIC_DISPATCH(score_rows)(image, margin_px, min_contrast, scores);
}

int fast_score_reference(ImageView image, int x, int y) {
  const int centre = image.at(x, y);
  int score = 0;
  for (int start = 0; start < kRingSize; ++start) {
    int brighter = 255;
    int darker = 255;
    for (int i = start; i < start + kArc; ++i) {
      const RingOffset offset = kRing[static_cast<std::size_t>(i % kRingSize)];
      const int difference = image.at(x + offset.x, y + offset.y) - centre;
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    score = std::max({score, brighter, darker});
  }
  return score;
}

std::span<Corner> find_corners(const PaddedImage& scores,
                               int margin_px,
                               int min_contrast,
                               std::vector<Corner>& buffer) {
  const std::size_t most = max_num_corners(scores.width_px(), scores.height_px());
  if (buffer.size() < most) buffer.resize(most);
  const std::size_t count =
      HWY_DYNAMIC_DISPATCH(find_maxima)(scores, margin_px, min_contrast, buffer.data());
  return {buffer.data(), count};
}

}  // namespace waymark
#endif

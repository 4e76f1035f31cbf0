// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/corners.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "waymark/base/check.h"
#include "waymark/features/fast.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/corners.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#ifndef WAYMARK_IMAGE_CORNERS_ONCE
#define WAYMARK_IMAGE_CORNERS_ONCE
namespace waymark {
namespace {

// With the frame of one pixel that the neighbours need, a row of a tile fills the widest vectors.
inline constexpr int kTileWidth = 62;
inline constexpr int kTileHeight = 32;

// A bit for each pixel of a tile that is a maximum, from left to right.
using TileMaxima = std::array<std::uint64_t, kTileHeight>;

}  // namespace
}  // namespace waymark
#endif

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<std::uint8_t, PaddedImage::kPadding>;

HWY_INLINE std::uint64_t maxima_of_lanes(const std::uint8_t* HWY_RESTRICT scores,
                                         std::ptrdiff_t stride) {
  const Tag d;
  const auto load = [&](std::ptrdiff_t offset) HWY_ATTR { return hn::LoadU(d, scores + offset); };
  const auto before =
      hn::Max(hn::Max(load(-stride - 1), load(-stride)), hn::Max(load(-stride + 1), load(-1)));
  const auto after =
      hn::Max(hn::Max(load(stride - 1), load(stride)), hn::Max(load(stride + 1), load(1)));
  // At least as large as those before, that is, larger than one less; and never 0.
  const auto rest = hn::Max(hn::SaturatedSub(before, hn::Set(d, std::uint8_t{1})), after);
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, hn::Ne(hn::Max(load(0), rest), rest), bytes);
  std::uint64_t bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

// scores is the first pixel of the tile; there are scores all around it.
void find_maxima(
    const std::uint8_t* scores, std::ptrdiff_t stride, int width, int height, TileMaxima& maxima) {
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  const std::uint64_t within = (std::uint64_t{1} << width) - 1;
  for (int y = 0; y < height; ++y) {
    std::uint64_t bits = 0;
    for (int x = 0; x < width; x += lanes) {
      bits |= maxima_of_lanes(scores + y * stride + x, stride) << x;
    }
    maxima[static_cast<std::size_t>(y)] = bits & within;
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(find_maxima);

namespace {

Window with_frame(const Window& window) {
  return {window.x_px - 1, window.y_px - 1, window.width_px + 2, window.height_px + 2};
}

int count(const TileMaxima& maxima, int height) {
  int sum = 0;
  for (int y = 0; y < height; ++y) sum += std::popcount(maxima[static_cast<std::size_t>(y)]);
  return sum;
}

// scores(0, 0) is the pixel left and above of the tile.
Corner* append(const TileMaxima& maxima,
               const Window& tile,
               const std::uint8_t* scores,
               std::ptrdiff_t stride,
               Corner* next) {
  for (int y = 0; y < tile.height_px; ++y) {
    const std::uint8_t* const row = scores + (y + 1) * stride + 1;
    for (std::uint64_t bits = maxima[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
      const int x = std::countr_zero(bits);
      *next++ = {static_cast<std::uint16_t>(tile.x_px + x),
                 static_cast<std::uint16_t>(tile.y_px + y),
                 row[x]};
    }
  }
  return next;
}

// The scores of the band begin at the pixel left and above of it.
Corner* find_in_band(const PaddedImage& image,
                     const Window& band,
                     const CornerRequest& request,
                     CornerWorkspace& workspace,
                     Corner* next) {
  const int strong = std::max(kStrongContrast, request.min_contrast);
  fast_scores(image, with_frame(band), strong, workspace.band);
  const std::ptrdiff_t stride = workspace.band.stride();
  TileMaxima maxima;
  for (int x = 0; x < band.width_px; x += kTileWidth) {
    const int width = std::min(kTileWidth, band.width_px - x);
    const Window tile{band.x_px + x, band.y_px, width, band.height_px};
    const std::uint8_t* scores = workspace.band.row(0) + x;
    HWY_DYNAMIC_DISPATCH(find_maxima)(scores + stride + 1, stride, width, tile.height_px, maxima);
    const double needed = request.density * width * tile.height_px;
    if (count(maxima, tile.height_px) >= std::max(needed, 1.0)) {
      next = append(maxima, tile, scores, stride, next);
      continue;
    }
    fast_scores(image, with_frame(tile), request.min_contrast, workspace.tile);
    const std::ptrdiff_t tile_stride = workspace.tile.stride();
    scores = workspace.tile.row(0);
    HWY_DYNAMIC_DISPATCH(find_maxima)
    (scores + tile_stride + 1, tile_stride, width, tile.height_px, maxima);
    next = append(maxima, tile, scores, tile_stride, next);
  }
  return next;
}

}  // namespace

std::span<Corner> find_corners(const PaddedImage& image,
                               const CornerRequest& request,
                               CornerWorkspace& workspace,
                               std::vector<Corner>& buffer) {
  WAYMARK_CHECK(request.border_px > kFastRadius);
  const std::size_t most = max_num_corners(image.width_px(), image.height_px());
  if (buffer.size() < most) buffer.resize(most);
  const int width = image.width_px() - 2 * request.border_px;
  const int bottom = image.height_px() - request.border_px;
  Corner* next = buffer.data();
  for (int y = request.border_px; width > 0 && y < bottom; y += kTileHeight) {
    const Window band{request.border_px, y, width, std::min(kTileHeight, bottom - y)};
    next = find_in_band(image, band, request, workspace, next);
  }
  return {buffer.data(), static_cast<std::size_t>(next - buffer.data())};
}

}  // namespace waymark
#endif

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.h"
#include "waymark/image/padded_image.h"

namespace waymark {

/// Rows in the making; reused.
struct DownscaleWorkspace {
  std::vector<std::int16_t> row;        ///< Interpolated between two rows, 7 fractional bits.
  std::vector<std::int16_t> weights;    ///< Of the right neighbour, 15 fractional bits.
  std::vector<std::uint8_t> with_gaps;  ///< Interpolated between columns; each sixth is void.
};

/// Bilinear interpolation at every 6/5 = 1.2 pixels: pixel j of the result is at 1.2 j + 0.1 of the
/// source, so that both images share their top left corner and weights repeat every 5 pixels.
/// The result has floor(5/6 of the size) pixels, all of them inside of the source.
void downscale(const PaddedImage& source, DownscaleWorkspace& workspace, PaddedImage& result);

/// An image at ever smaller scales. Level 0 is the image itself; a pixel of level i is exactly
/// 1.2^i pixels of level 0 wide (columns and rows of a level that do not fill one of the next are
/// cropped, never squeezed). Levels share the top left corner of the top left pixel; as (0, 0)
/// is the centre of that pixel, the same point has
///   x_level0 = (x_level + 0.5) * scale - 0.5.
class Pyramid {
 public:
  static constexpr int kNumLevels = 8;
  static constexpr double kScaleFactor = 1.2;

  /// Size in pixels of level 0 of a pixel of the level: 1.2^level.
  static double scale(int level) { return kScales[static_cast<std::size_t>(level)]; }
  static double level0_from_level(double coordinate_px, int level) {
    return (coordinate_px + 0.5) * scale(level) - 0.5;
  }
  static double level_from_level0(double coordinate_px, int level) {
    return (coordinate_px + 0.5) / scale(level) - 0.5;
  }

  /// Copies the image and builds the levels above it. Levels may be empty if the image is tiny.
  void build(ImageView image);

  ImageView level(int level) const { return image(level).view(); }
  const PaddedImage& image(int level) const { return levels_[static_cast<std::size_t>(level)]; }

 private:
  static constexpr std::array<double, kNumLevels> kScales = [] {
    std::array<double, kNumLevels> scales{1.0};
    for (std::size_t i = 1; i < scales.size(); ++i) scales[i] = scales[i - 1] * kScaleFactor;
    return scales;
  }();

  std::array<PaddedImage, kNumLevels> levels_;
  DownscaleWorkspace workspace_;
};

}  // namespace waymark

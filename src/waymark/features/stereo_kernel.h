// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "waymark/image/image.h"

namespace waymark {

/// Side of the patch of the search along an epipolar curve, and of the one that is aligned.
inline constexpr int kSearchSize = 8;
inline constexpr int kSearchArea = kSearchSize * kSearchSize;
inline constexpr int kAlignSize = 12;
inline constexpr int kAlignArea = kAlignSize * kAlignSize;

/// Grey values that a vector kernel loads beyond the last one it uses.
inline constexpr int kStereoOverread = 16;

using SearchPatch = std::array<std::int16_t, kSearchArea>;  ///< Grey values, row-major.

/// Top left pixel of a patch.
struct PatchCorner {
  int x;
  int y;
};

/// Normalised cross-correlation, from -1 to 1, of a patch with the image at each corner; 0 where
/// one of the two is flat. The patches must lie in the image, whose rows are followed by
/// kStereoOverread values that may be read.
void correlate(const SearchPatch& patch,
               ImageView image,
               std::span<const PatchCorner> corners,
               std::span<float> correlations);

/// The part of a patch that is compared during alignment; row-major. The derivatives are made
/// orthogonal to the values and to a constant, so that they are blind to gain and bias.
struct AlignPatch {
  alignas(16) std::array<float, kAlignArea> value;   ///< Mean 0.
  alignas(16) std::array<float, kAlignArea> along;   ///< Derivative along the curve.
  alignas(16) std::array<float, kAlignArea> across;  ///< Derivative across it.
};

/// Sums over the pixels v of an image at the place of a patch.
struct AlignSums {
  float v;
  float v_v;
  float v_value;
  float v_along;
  float v_across;

  friend bool operator==(const AlignSums&, const AlignSums&) = default;
};

/// The image is interpolated bilinearly at corner + (fraction_x, fraction_y), fractions in [0, 1).
/// Must lie in the image with one more column and row; overread as above. The order of the sums is
/// the same on every processor: four partial sums by column modulo 4.
AlignSums sum_patch(const AlignPatch& patch,
                    ImageView image,
                    PatchCorner corner,
                    float fraction_x,
                    float fraction_y);

/// Scalar forms of the above, with the same bits.
void correlate_reference(const SearchPatch& patch,
                         ImageView image,
                         std::span<const PatchCorner> corners,
                         std::span<float> correlations);
AlignSums sum_patch_reference(const AlignPatch& patch,
                              ImageView image,
                              PatchCorner corner,
                              float fraction_x,
                              float fraction_y);

}  // namespace waymark

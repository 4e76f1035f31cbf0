// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "waymark/features/stereo_kernel.h"
#include "waymark/image/image.h"

namespace waymark {

/// Where to cut a patch out of an image: the pixel of the image at offset d from the patch's centre
/// is center + image_from_patch * d.
struct PatchFrame {
  Eigen::Vector2d center;
  Eigen::Matrix2d image_from_patch;
};

/// Nothing where the patch does not lie in the image.
std::optional<SearchPatch> cut_search_patch(ImageView image, const PatchFrame& frame);

/// A patch to be aligned with another image by moving it along a line.
struct AlignTemplate {
  AlignPatch patch;
  Eigen::Vector2d direction;  ///< Unit; the line, in pixels of the patch.
  float value_square;         ///< Sum of the squared values,
  float along_square;         ///< of the squared derivatives along the line,
  float across_square;        ///< and across it,
  float along_across;         ///< and of their products.
};

/// Nothing where the patch does not lie in the image or shows nothing along the line.
std::optional<AlignTemplate> cut_align_template(ImageView image,
                                                const PatchFrame& frame,
                                                const Eigen::Vector2d& direction);

struct Alignment {
  double along_px;    ///< From the start.
  double across_px;   ///< What the patch would still move across the line if it were free to.
  float correlation;  ///< Normalised, of the patch with the image, where it ended.
};

/// Moves the template along its line until it fits the image best in the sense of least squares
/// with free gain and bias: inverse compositional Gauss-Newton (Baker and Matthews 2004, 3.2).
/// Nothing if it does not come to rest within kMaxAlignPx of the start.
inline constexpr double kMaxAlignPx = 3.0;
std::optional<Alignment> align(const AlignTemplate& patch,
                               ImageView image,
                               const Eigen::Vector2d& start);

}  // namespace waymark

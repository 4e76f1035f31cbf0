// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/calibrate/lens.h"
#include "waymark/camera/camera.h"
#include "waymark/features/features.h"
#include "waymark/image/image.h"

namespace waymark {

/// Pixels that show the same points in two images, wrong ones among them.
struct PixelMatches {
  std::vector<Eigen::Vector2d> pixels_a, pixels_b;  ///< In parallel; level 0.
  std::vector<float> scales_a, scales_b;            ///< Size of one pixel of the feature's level.
  double shift_px = 0.0;                            ///< Median distance in the image.
};

/// What looks alike in two images; nothing where that is too little to tell.
std::optional<PixelMatches> match_pixels(const Features& a, const Features& b);

/// Pairs of images of a stretch, spread over it, each as far apart as enough of what the first
/// shows is recognised in the second. Looks at pixels and their surroundings only; the camera says
/// which part of the image has any. Masks, as many, are empty or 0 where the image is not to be
/// used.
std::vector<PixelMatches> match_stretch(std::span<const Image> images,
                                        std::span<const Image> masks,
                                        const CameraDescription& any);

/// How badly a camera explains matches: the geometric robust information criterion (Torr 1998) of
/// the best of scene, plane and rotation for each pair, summed, per match.
double two_view_cost(const Camera& camera, std::span<const PixelMatches> pairs);

/// A lens by its horizontal field of view and the coefficient of the division model.
struct DivisionLens {
  double fov_rad = 0.0;
  double division = 0.0;

  /// Focal length of images that are that wide; infinite or 0 where there is none.
  double focal_px(int width_px) const;
};

/// The lens that explains matches best, of all fields of view (horizontal; unless it is known) and
/// strengths of distortion; where nothing tells, the likeliest. Principal point and size are those
/// of `assumed`.
DivisionLens find_division_lens(std::span<const PixelMatches> pairs,
                                const CameraDescription& assumed,
                                std::optional<double> known_fov_rad = std::nullopt);

}  // namespace waymark

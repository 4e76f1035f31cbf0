// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"
#include "waymark/marker/family.h"

namespace waymark {

/// How well an image shows a marker, and where exactly.
struct PatternFit {
  Rigid3 cam_from_marker;      ///< Lengths by the side of the marker.
  double correlation = 0.0;    ///< Of its pixels with how the pattern should look, up to 1.
  double contrast = 0.0;       ///< Grey values from its black to its white.
  double least_squares = 0.0;  ///< Mean squared difference of the pixels, of grey values.
  double blur_px = 0.0;        ///< Standard deviation of the blur that fits best.
};

/// Moves a marker of a known number until it looks as the image does: its pattern, drawn through
/// the camera and blurred as much as the image is, is aligned with all pixels at once, by
/// Gauss-Newton over the six numbers of its pose and the grey values of black, white and what lies
/// around (Lucas and Kanade 1981; Baker and Matthews 2004). So nothing has to be told apart in it:
/// a few pixels of side do.
///
/// cam_from_marker: to within about two pixels; lengths by the side. Nothing for markers that are
/// not wholly in the image, are larger than 96 pixels, seen from behind, or lost on the way.
std::optional<PatternFit> fit_pattern(ImageView image,
                                      const Camera& camera,
                                      const MarkerFamily& family,
                                      int id,
                                      const Rigid3& cam_from_marker);

/// Whether a fit is that of this number: its pattern is there with some contrast, and others of the
/// family that are drawn in its place explain the image less.
bool is_own_pattern(ImageView image,
                    const Camera& camera,
                    const MarkerFamily& family,
                    int id,
                    const PatternFit& fit);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "waymark/calibrate/lens.h"
#include "waymark/map/map.h"

namespace waymark {

/// A lens that fits a map best.
struct RefinedLens {
  CameraDescription description;
  LensChange sigmas = LensChange::Zero();  ///< Standard deviations, of the residuals' own noise.
  double reprojection_px = 0.0;            ///< Root mean square of what is left.
  std::size_t num_keyframes = 0;           ///< That took part.
};

/// Bundle adjustment of the largest sub-map with the numbers of its lens as unknowns beside poses
/// and points: Levenberg-Marquardt, points eliminated, a dense system of the rest. The map is one
/// of a single camera, made with `lens`; what the images do not tell stays near `assumed`, by
/// lens_sigmas(). Nothing where the map is too small.
std::optional<RefinedLens> refine_lens(const Map& map,
                                       const CameraDescription& assumed,
                                       const CameraDescription& lens,
                                       double focal_sigma);

}  // namespace waymark

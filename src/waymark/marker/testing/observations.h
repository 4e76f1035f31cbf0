// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "waymark/base/rng.h"
#include "waymark/marker/marker.h"
#include "waymark/marker/testing/draw.h"

namespace waymark::testing {

/// What a camera of 500 px focal length sees of a marker, with noise; by itself, without an image.
inline MarkerObservation make_observation(int id,
                                          const Rigid3& cam_from_marker,
                                          double side,
                                          double noise_px = 0.0,
                                          std::uint64_t stream = 0) {
  constexpr double kFocalPx = 500.0;
  Rng rng(9, stream);
  MarkerObservation observation;
  observation.id = id;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d seen = (cam_from_marker * marker_corner(i, side)).normalized();
    const Eigen::Vector3d across = seen.unitOrthogonal();
    const Eigen::Vector3d along = seen.cross(across);
    const Eigen::Vector3d noisy =
        seen + noise_px / kFocalPx * (rng.normal() * across + rng.normal() * along);
    observation.bearings[i] = noisy.normalized().cast<float>();
    observation.pixel_from_bearing[i] << kFocalPx * across.cast<float>().transpose(),
        kFocalPx * along.cast<float>().transpose();
    observation.pixels[i].setZero();
  }
  return observation;
}

}  // namespace waymark::testing

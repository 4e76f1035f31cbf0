// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/marker/marker.h"

namespace waymark {

/// The poses from which a camera may see a square as it does, the better one first: two, as a small
/// square looks alike from two sides (Collins and Bartoli 2014, IPPE; by OpenCV). side: of the
/// square, in any unit. cam_from_marker; empty for what is no image of a square.
std::vector<Rigid3> square_poses(const MarkerObservation& observation, double side);

/// Mean squared distance of the corners from where a pose has them, in px^2.
double squared_error_px(const MarkerObservation& observation,
                        const Rigid3& cam_from_marker,
                        double side);

/// Length of a side in the image, on the average.
double mean_side_px(const MarkerObservation& observation);

}  // namespace waymark

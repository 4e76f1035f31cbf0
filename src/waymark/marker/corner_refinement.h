// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "waymark/camera/camera.h"
#include "waymark/image/image.h"

namespace waymark {

/// Measures the corners of a marker to a fraction of a pixel. Along each side the image is searched
/// across it for where the slope is steepest; through the bearings of these places a great circle
/// is laid, for the image of a straight line is one through any central camera, whatever its
/// distortion; neighbouring circles meet in the corners.
///
/// corners: to within about a pixel, clockwise in the image, the marker being dark on light.
/// side_modules: of the marker, which says how far the search may reach. Nothing where a side shows
/// too few places, or a corner ends up more than a module off.
std::optional<std::array<Eigen::Vector2d, 4>> refine_marker_corners(
    ImageView image,
    const Camera& camera,
    const std::array<Eigen::Vector2d, 4>& corners,
    int side_modules);

}  // namespace waymark

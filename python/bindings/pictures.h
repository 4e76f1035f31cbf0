// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark::python {

/// What a small picture shows: points, and ways of cameras, each in its order.
struct MapPicture {
  std::vector<Eigen::Vector3d> points;    ///< In the world.
  std::vector<std::vector<Rigid3>> ways;  ///< world_from_rig, in the same world.
};

/// A picture from above, up being what the cameras take for it on average, as an SVG element that
/// stands by itself in a page. At most 1500 points are drawn, evenly chosen; those that lie far out
/// are left out. Empty where there is nothing to see.
std::string draw_svg(const MapPicture& picture);

/// The same with a line of text below, for notebooks.
std::string draw_html(const MapPicture& picture, const std::string& caption);

}  // namespace waymark::python

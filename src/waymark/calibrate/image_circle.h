// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "waymark/image/image.h"

namespace waymark {

/// Whether images show all directions: twice as wide as high, with a left border that goes on at
/// the right one.
bool are_equirectangular(std::span<const Image> images);

/// The circle that a fisheye lens lights, in pixels.
struct ImageCircle {
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  double radius_px = 0.0;
};

/// The circle outside of which no image shows anything; nothing where there is none.
std::optional<ImageCircle> find_image_circle(std::span<const Image> images);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/perspective.h"
#include "waymark/image/image.h"

namespace waymark {

/// A perspective part, without distortion, of what a camera sees.
struct SplitPart {
  std::shared_ptr<const Camera> camera;  ///< The one that took the image.
  Eigen::Quaterniond part_from_camera = Eigen::Quaterniond::Identity();
  PerspectiveModel pinhole;  ///< Pixels are as large as those of the middle of the image.
  int width_px = 0;
  int height_px = 0;
  bool is_only_one = false;  ///< Of its camera: views keep their names.
  bool sees_all = false;     ///< No part of it lies outside of the image or its circle.
};

inline constexpr int kMinSplitViews = 4;
inline constexpr int kMaxSplitViews = 32;

/// Parts of 90 degrees of a camera that is not perspective. Of a 360 degree camera 6 are the faces
/// of a cube, and any other number a ring around the horizon; of others one looks straight ahead
/// and the rest in a ring around it, 55 degrees off the axis.
std::vector<SplitPart> split_parts(std::shared_ptr<const Camera> camera, int num_views);

/// The largest upright rectangle between the rims of the image, up to 60 degrees off the axis,
/// where a pixel covers an eighth of what one on the axis does. InputError for a camera that does
/// not see what is ahead, or sees all around.
SplitPart undistorted_part(std::shared_ptr<const Camera> camera);

/// Where the pixels of a part, row by row, lie in the image.
struct SplitLookup {
  std::vector<Eigen::Vector2d> pixels;   ///< Of the image.
  std::vector<std::uint8_t> is_visible;  ///< 0: outside of it or its circle.
};

/// Of a part.
SplitLookup make_lookup(const SplitPart& part);

/// Where a part shows something: 255, else 0 (outside of the image or its circle).
Image split_mask(const SplitPart& part);

/// The same by the lookup of the part.
Image split_mask(const SplitPart& part, const SplitLookup& lookup);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/registry.h"

namespace waymark {

/// Names that named_camera() knows: one for each model of the library, "fisheye" of 160 degrees,
/// and "fisheye_200" of 200 degrees, an image circle with black corners.
std::vector<std::string> camera_names();

/// A camera of typical numbers, of a height in pixels; wide cameras are square, the perspective one
/// is 4:3, equirectangular 2:1. Throws InputError for an unknown name.
CameraDescription named_camera(std::string_view name, int height_px);

}  // namespace waymark

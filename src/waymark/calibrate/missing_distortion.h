// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/calibrate/model_selection.h"
#include "waymark/camera/camera.h"
#include "waymark/map/map.h"

namespace waymark {

/// Pairs of keyframes, spread over the map, each as far apart as enough is recognised. Looks at
/// pixels and their surroundings only, so that a map that is bent does not matter.
std::vector<PixelMatches> match_keyframes(const Map& map);

/// Whether pairs of images contradict a pinhole camera that is said to have no distortion, as
/// drivers say of any. Strengths of radial distortion compete as in find_division_lens(), focal
/// length and principal point being those stated. Gives the camera with the distortion (radtan)
/// that explains the matches best; nothing unless that moves the corners of the image by more than
/// 3 % of half the diagonal, and explains them clearly better than the camera in use does, which is
/// the stated one or what became of it.
std::optional<CameraDescription> find_missing_distortion(std::span<const PixelMatches> pairs,
                                                         const CameraDescription& ideal,
                                                         const Camera& in_use);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "waymark/map/map.h"
#include "waymark/mapping/calibrate.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Estimates by how much the inverse depths of depth images are too large together with the poses
/// and points of a problem, whose observations are `observed` in the map, and measures the problem
/// anew with what it finds. Nothing, and the problem left alone, where the images do not contradict
/// the offset in use, or there is no depth image.
std::optional<KnownCalibration> find_depth_offset(const Map& map,
                                                  std::span<const Observation> observed,
                                                  const KnownCalibration& known,
                                                  BundleProblem& problem);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "waymark/map/map.h"
#include "waymark/mapping/calibrate.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Estimates the readout of the cameras, which is one for all of them, together with the poses and
/// points of a problem, whose observations are `observed` in the map, and measures the problem anew
/// with what it finds. Nothing, and the problem left alone, where the images do not contradict the
/// readout in use: where cameras that read all rows at once, or hardly turned, saw them.
std::optional<KnownCalibration> find_readout(const Map& map,
                                             std::span<const Observation> observed,
                                             const KnownCalibration& known,
                                             BundleProblem& problem);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "waymark/calibration/calibration_choice.h"
#include "waymark/calibration/known_calibration.h"
#include "waymark/map/map.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Adjusts the calibration together with the poses and points of a problem, whose observations are
/// `observed` in the map, and measures the problem anew with what it finds: bundle adjustment with
/// the numbers of the cameras as unknowns (Triggs et al. 2000). Nothing, and the problem left
/// alone, where the images do not contradict the calibration: see docs/decisions/calibrate.md.
std::optional<KnownCalibration> recalibrate(const Map& map,
                                            std::span<const Observation> observed,
                                            const KnownCalibration& known,
                                            FreeParameters free,
                                            BundleProblem& problem);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Adds the markers of a map to a problem whose poses are those of `keyframes`, in this order,
/// behind all that is there. A marker is a pose as a rig is: that of a camera that stands before it
/// and sees its corners where the square of its size has them, as exactly as prints are made. The
/// corners are points that keyframes see as well: so they are held by each other and hold the
/// scale. Surveyed markers stay where they are. Markers that fewer than two of the keyframes see
/// tell nothing and are left out.
///
/// Returns the rigs of the markers, which have to live as long as the problem. Not for problems
/// with an unknown calibration.
std::vector<std::shared_ptr<const Rig>> add_markers(const Map& map,
                                                    std::span<const KeyframeId> keyframes,
                                                    BundleProblem& problem);

/// Whether keyframes of a sub-map see a surveyed marker, which then holds it in place.
bool is_held_by_survey(const Map& map, SubmapId submap);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/mapping/associate.h"
#include "waymark/match/projection.h"

namespace waymark {

/// Finds landmarks that are one and the same, between a keyframe and its surroundings, by
/// projecting what either side sees into the other: adds missing observations and merges
/// duplicates.
void fuse_with_neighbours(Map& map,
                          KeyframeId keyframe,
                          ProjectionMatcher& matcher,
                          DirtyLandmarks& dirty);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"
#include "waymark/mapping/associate.h"
#include "waymark/match/projection.h"

namespace waymark {

/// Makes one of what keyframes that look at the same from near each other hold for different
/// landmarks, though they are not neighbours in the graph: the camera came by again later. For a
/// map whose loops are closed and adjusted.
void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty);

}  // namespace waymark

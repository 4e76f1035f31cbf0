// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/mapping/associate.h"
#include "waymark/mapping/options.h"

namespace waymark {

/// New landmarks of the points on edges of a keyframe that have none. Each is looked for along its
/// epipolar curves in several neighbours: where an edge of the same direction crosses the curve
/// the point may be, at a distance that follows. Points on edges look alike, so that a single
/// crossing says little; the distance is the one that the most keyframes agree on within their
/// standard deviations, if no other comes near (after Vogiatzis and Hernandez 2011, who fuse depth
/// along the ray). Edges along their epipolar curve tell nothing.
void triangulate_edges(Map& map,
                       KeyframeId keyframe,
                       DirtyLandmarks& dirty,
                       const EdgeOptions& options = {});

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/loop/revisit.h"
#include "waymark/map/map.h"
#include "waymark/mapping/associate.h"
#include "waymark/match/projection.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// Closes a loop within a sub-map: spreads the drift over all keyframes, makes one of what query,
/// match and their neighbours see twice, and notes the loop edge. What is left of the error is for
/// a global bundle adjustment.
void close_loop(Map& map,
                const Revisit& revisit,
                ProjectionMatcher& matcher,
                DirtyLandmarks& dirty);

/// Joins the sub-maps of query and match, which must both be metric or both not: the younger moves
/// by one similarity to where the older has the place, in its frame and units, and belongs to it
/// from then on. Then as for a loop.
void join_submaps(Map& map,
                  PlaceIndex& places,
                  const Revisit& revisit,
                  ProjectionMatcher& matcher,
                  DirtyLandmarks& dirty);

/// Closes the loop or joins the sub-maps, whichever the revisit is; true of a join.
bool close_revisit(Map& map,
                   PlaceIndex& places,
                   const Revisit& revisit,
                   ProjectionMatcher& matcher,
                   DirtyLandmarks& dirty);

}  // namespace waymark

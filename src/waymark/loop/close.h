// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/loop/drift.h"
#include "waymark/map/correction.h"
#include "waymark/map/map.h"
#include "waymark/mapping/associate.h"
#include "waymark/match/projection.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// Makes the map agree with a revisit, notes it as a loop edge and makes one of what query, match
/// and their neighbours hold for different landmarks. Within a sub-map that closes a loop: the
/// drift is spread over all keyframes (spread_drift()), and what is left of the error is for a
/// global bundle adjustment. Two sub-maps, which must both be metric or both not, are joined: the
/// younger moves by one similarity to where the older has the place, in its frame and units, and
/// belongs to it from then on. Returns whether it was a join.
bool close_revisit(Map& map,
                   PlaceIndex& places,
                   const Revisit& revisit,
                   ProjectionMatcher& matcher,
                   DirtyLandmarks& dirty);

/// Where the keyframes of a sub-map belong if a loop is to close: those of a pose graph (Strasdat
/// et al. 2010) of the essential graph of Mur-Artal et al. (2015, III.D), which is the spanning
/// tree, strong covisibility and the loops so far, and of the new loop; over similarities where the
/// scale is free. The root stays.
MapCorrection spread_drift(const Map& map, const LoopEdge& loop);

/// Makes one of what keyframes that look at the same from near each other hold for different
/// landmarks, though they are not neighbours in the graph: the camera came by again later. For a
/// map whose loops are closed and adjusted.
void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty);

}  // namespace waymark

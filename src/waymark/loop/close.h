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

/// The loop of a candidate within a sub-map.
inline LoopEdge as_loop(const LoopCandidate& candidate) {
  return {candidate.match, candidate.query, candidate.query_from_match};
}

/// Closes a loop within a sub-map: moves keyframes as optimize_loop() says, notes the loop edge,
/// and makes one of what query, match and their neighbours hold for different landmarks. What is
/// left of the error is for a global bundle adjustment.
void close_loop(Map& map,
                const LoopCandidate& candidate,
                const MapCorrection& correction,
                ProjectionMatcher& matcher,
                DirtyLandmarks& dirty);

/// Joins two sub-maps, which must both be metric or both not: the younger moves by one similarity
/// to where the older has the place, in its frame and units, and belongs to it from then on. The
/// candidate is noted as a loop edge, and landmarks are made one as in close_loop().
void join_submaps(Map& map,
                  PlaceIndex& places,
                  const LoopCandidate& candidate,
                  ProjectionMatcher& matcher,
                  DirtyLandmarks& dirty);

/// Makes one of what keyframes that look at the same from near each other hold for different
/// landmarks, though they are not neighbours in the graph: the camera came by again later. For a
/// map whose loops are closed and adjusted.
void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty);

}  // namespace waymark

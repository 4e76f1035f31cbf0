// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// Joins sub-maps in metres that know the same markers, each to the oldest that shares one with it:
/// the younger one is put where its markers are those of the older one, of which more than half of
/// those that both know have to agree. Afterwards each marker is there once, seen by keyframes of
/// both. Gives how many were joined.
int join_by_markers(Map& map, PlaceIndex& places);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/mapping/associate.h"
#include "waymark/mapping/options.h"
#include "waymark/match/projection.h"

namespace waymark {

/// Looks in a keyframe for what any of the sources sees and it does not: adds the observations that
/// are missing and merges the landmarks that are one and the same.
void fuse_into(Map& map,
               std::span<const KeyframeId> sources,
               KeyframeId target,
               ProjectionMatcher& matcher,
               DirtyLandmarks& dirty);

/// Makes one landmark of two; the one with more observers survives.
void merge(Map& map, LandmarkId a, LandmarkId b, DirtyLandmarks& dirty);

/// Finds landmarks that are one and the same, between a keyframe and its surroundings, by
/// projecting what either side sees into the other: adds missing observations and merges
/// duplicates.
void fuse_with_neighbours(Map& map,
                          KeyframeId keyframe,
                          ProjectionMatcher& matcher,
                          DirtyLandmarks& dirty,
                          const FuseOptions& options = {});

}  // namespace waymark
